// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "alidade/sweep/sweep.h"

namespace alidade::internal {

/// Seeds with the largest errors of one estimator.
struct WorstSeeds {
  std::string estimator;
  std::string metric;                ///< label of the metric, as in `rmse target.depth`
  std::vector<std::uint64_t> seeds;  ///< at most three seeds, the worst first
  std::vector<std::string> values;   ///< the metric of each seed, with its unit
};

/// Finds the worst seeds of each estimator, including runs in which the estimator diverged. The
/// metric is the first that exists of the mean NEES, the RMSE and the mean NIS. Omits an estimator
/// with at most three finished runs, because all of its seeds would be listed.
std::vector<WorstSeeds> FindWorstSeeds(const SweepResult& result);

/// Returns an empty line, and a line for each estimator, as in `worst seeds of ekf by rmse
/// target.depth: 36 (7.7 m), 96 (3.1 m), 60 (2.9 m)`. Returns "" for an empty list.
std::string WorstSeedLines(const std::vector<WorstSeeds>& worst);

}  // namespace alidade::internal
