// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "alidade/estimation/problem.h"

namespace alidade {

/// How the estimates of an estimator rest on the measurements, by which a comparison knows what it
/// can be compared with.
enum class EstimatorKind {
  kFilter,    ///< takes each measurement once, as it comes
  kSmoother,  ///< a filter, and then all later measurements, about its linearisation
  kBatch,  ///< solves for all states anew, by all measurements or (`mode: filtering`) those so far
  kSlidingWindow,  ///< solves for the last states anew
};
/// `filter`, `smoother`, `batch`, `sliding_window`.
const char* ToString(EstimatorKind kind);

/// What an estimator can do with a problem, beyond blocks that are estimated or constant.
struct EstimatorCapabilities {
  bool consider = false;          ///< consider blocks and roles (Schmidt)
  bool known = true;              ///< known roles
  bool at_measurement = false;    ///< jacobian_at: measurement
  bool from_measurement = false;  ///< blocks that start from their first measurement
  bool recovery = false;          ///< after consecutive rejections
  bool landmarks = false;         ///< that come and go
};

/// Why a problem cannot be solved: for a block, for a role of a sensor, or without either for its
/// landmarks.
struct ProblemDefect {
  const char* key;     ///< of a config: `consider`, `from_measurement`, `mode`, `jacobian_at`
  std::string what;    ///< `consider blocks`
  std::string remedy;  ///< what to write in its place: `the block estimated or constant`
  BlockId block = -1;
  int sensor = -1;           ///< index into Problem::sensors
  int role = -1;             ///< index into its roles
  std::string nearest = {};  ///< the name that may be meant, or ""
};

/// The first defect that no estimator can do anything about, blocks before sensors: a block that
/// starts from the measurement of a sensor that is not there or does not determine it, a cycle of
/// blocks that start from one another, a role without an inverse measurement model that is
/// linearised at its measurement. Nothing if there is none.
std::optional<ProblemDefect> FindDefect(const Problem& problem);
/// The first thing that `problem` asks for beyond `capabilities`, blocks before sensors; nothing if
/// all can be done. Recovery is an option of the estimator, and not looked at.
std::optional<ProblemDefect> FindUnsupported(const Problem& problem,
                                             const EstimatorCapabilities& capabilities);
/// The problem. Error kBadConfig, by name and with the remedy, if it has a defect of either kind.
/// `estimator`: `Ukf`.
Problem CheckedProblem(Problem problem, const char* estimator,
                       const EstimatorCapabilities& capabilities);

}  // namespace alidade
