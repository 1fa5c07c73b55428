// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "alidade/estimation/problem.h"

namespace alidade {

/// Kind of an estimator: how it uses the measurements. Determines which estimators can be compared.
enum class EstimatorKind {
  kFilter,    ///< uses each measurement once, in the order of the frames
  kSmoother,  ///< a filter, then a backward pass with the Jacobians of the filter
  /// Solves for all states. Uses all measurements for each state, or with `mode: filtering` only
  /// those up to its time.
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

/// Reason why an estimator cannot solve a problem. Names the block or the role of a sensor that
/// causes it. If neither is set, the landmarks cause it.
struct ProblemDefect {
  const char* key;  ///< key in a config: `consider`, `from_measurement`, `mode`, `jacobian_at`
  std::string description;  ///< such as `consider blocks`
  std::string remedy;       ///< accepted alternative, such as `the block estimated or constant`
  BlockId block = -1;
  int sensor = -1;           ///< index into Problem::sensors
  int role = -1;             ///< index into the roles of the sensor
  std::string nearest = {};  ///< existing name closest to an unknown one, or ""
};

/// Returns the first defect that makes a problem invalid for every estimator, or nullopt. Blocks
/// are checked before sensors. The defects are:
///   - a block starts from a sensor that does not exist or does not determine the block;
///   - blocks start from one another in a cycle;
///   - a role without an inverse measurement model has `jacobian_at: measurement`.
std::optional<ProblemDefect> FindDefect(const Problem& problem);
/// Returns the first feature of `problem` that `capabilities` does not include, or nullopt. Blocks
/// are checked before sensors. Recovery is an option of the estimator and is not checked.
std::optional<ProblemDefect> FindUnsupported(const Problem& problem,
                                             const EstimatorCapabilities& capabilities);
/// Returns the problem. If FindUnsupported or FindDefect finds a defect, throws Error kBadConfig
/// with the name of the block or role, and the remedy. `estimator` is the name of the estimator in
/// the message, such as `Ukf`.
Problem CheckedProblem(Problem problem, const char* estimator,
                       const EstimatorCapabilities& capabilities);

}  // namespace alidade
