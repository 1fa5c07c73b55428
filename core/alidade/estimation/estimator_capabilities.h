// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "alidade/estimation/problem.h"

namespace alidade {

/// Use of the measurements by an estimator. It determines which estimators can be compared.
enum class EstimatorKind {
  kFilter,    ///< uses each measurement once, in the order of the frames
  kSmoother,  ///< a filter, then a backward pass about the linearisation of the filter
  kBatch,     ///< solves for all states, by all or (`mode: filtering`) all previous measurements
  kSlidingWindow,  ///< solves for the states of a sliding window
};
/// Returns `filter`, `smoother`, `batch` or `sliding_window`.
const char* ToString(EstimatorKind kind);

/// Capabilities of an estimator, beyond blocks that are estimated or constant.
struct EstimatorCapabilities {
  bool consider = false;          ///< consider blocks and roles (Schmidt)
  bool known = true;              ///< known roles
  bool at_measurement = false;    ///< jacobian_at: measurement
  bool from_measurement = false;  ///< blocks that start from their first measurement
  bool recovery = false;          ///< recovery after consecutive rejections
  bool landmarks = false;         ///< landmarks that are added and removed during a run
};

/// Reason why an estimator cannot solve a problem. It concerns a block, a role of a sensor, or (if
/// neither index is set) the landmarks.
struct ProblemDefect {
  const char* key;          ///< of a config: `consider`, `from_measurement`, `mode`, `jacobian_at`
  std::string description;  ///< `consider blocks`
  std::string remedy;       ///< the accepted alternative: `the block estimated or constant`
  BlockId block = -1;
  int sensor = -1;           ///< index into Problem::sensors
  int role = -1;             ///< index into its roles
  std::string nearest = {};  ///< the closest existing name, or ""
};

/// Returns the first defect that makes a problem invalid for every estimator, or nullopt. Blocks
/// are checked before sensors. The defects are:
///   - a block starts from a sensor that does not exist or does not determine it;
///   - blocks start from one another in a cycle;
///   - a role without an inverse measurement model has `jacobian_at: measurement`.
std::optional<ProblemDefect> FindDefect(const Problem& problem);
/// Returns the first feature of `problem` that `capabilities` does not include, or nullopt. Blocks
/// are checked before sensors. Recovery is an option of the estimator and is not checked.
std::optional<ProblemDefect> FindUnsupported(const Problem& problem,
                                             const EstimatorCapabilities& capabilities);
/// Returns the problem. Throws Error kBadConfig, with the name and the remedy, if FindUnsupported
/// or FindDefect finds a defect. `estimator` is the name for the message, such as `Ukf`.
Problem CheckedProblem(Problem problem, const char* estimator,
                       const EstimatorCapabilities& capabilities);

}  // namespace alidade
