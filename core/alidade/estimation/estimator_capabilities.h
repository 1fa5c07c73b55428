// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "alidade/estimation/problem.h"

namespace alidade {

/// Kind of an estimator, according to its use of the measurements. The kind determines which
/// estimators can be compared.
enum class EstimatorKind {
  kFilter,    ///< uses each measurement once, in the order of the frames
  kSmoother,  ///< runs a filter, then a backward pass with the Jacobians of the filter
  /// Solves for all states. Each state depends on all measurements. With `mode: filtering`, a state
  /// depends only on the measurements up to its time.
  kBatch,
  kSlidingWindow,  ///< solves for the states of a sliding window
};
/// Returns `filter`, `smoother`, `batch` or `sliding_window`.
const char* ToString(EstimatorKind kind);

/// Optional features of problems that an estimator supports. Every estimator supports blocks that
/// are estimated or constant.
struct EstimatorCapabilities {
  bool consider = false;          ///< consider blocks and roles (Schmidt)
  bool known = true;              ///< roles with RoleMode::kKnown
  bool at_measurement = false;    ///< roles with `jacobian_at: measurement`
  bool from_measurement = false;  ///< blocks that start from their first measurement
  bool recovery = false;          ///< recovery after consecutive rejections
  bool landmarks = false;         ///< landmarks that are added and removed during a run
};

/// Reason why an estimator cannot solve a problem. The cause is a block, or a role of a sensor. If
/// neither is set, the landmarks are the cause.
struct ProblemDefect {
  const char* key;          ///< key in a config, such as `consider` or `jacobian_at`
  std::string description;  ///< the defect, such as `consider blocks`
  std::string remedy;       ///< accepted alternative, such as `mean and sigma`
  BlockId block = -1;
  int sensor = -1;           ///< index into Problem::sensors
  int role = -1;             ///< index into the roles of the sensor
  std::string nearest = {};  ///< existing name that is most similar to an unknown name, or ""
};

/// Returns the first defect that makes a problem invalid for every estimator, or nullopt. Blocks
/// are checked before sensors. The possible defects are:
///   - a block starts from a sensor that does not exist or does not determine the block;
///   - the initialisation of a block depends on the block itself (a cycle);
///   - a role without an inverse measurement model has `jacobian_at: measurement`.
std::optional<ProblemDefect> FindDefect(const Problem& problem);
/// Returns the first feature of `problem` that `capabilities` does not include, or nullopt. Blocks
/// are checked before sensors. Recovery is not checked, because it is an option of the estimator.
std::optional<ProblemDefect> FindUnsupported(const Problem& problem,
                                             const EstimatorCapabilities& capabilities);
/// Returns the problem. If FindUnsupported or FindDefect finds a defect, throws Error kBadConfig.
/// The message contains `estimator`, such as `Ukf`, the name of the block or role, and the remedy.
Problem CheckedProblem(Problem problem, const char* estimator,
                       const EstimatorCapabilities& capabilities);

}  // namespace alidade
