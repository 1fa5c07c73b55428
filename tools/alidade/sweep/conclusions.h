// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "alidade/report/conclusion.h"
#include "alidade/sweep/sweep.h"

namespace alidade::internal {

/// Returns the sentences about divergence and about the mean NEES over the runs (TestScale). Runs
/// are independent, so this test finds errors that a single run is too short to show.
std::vector<Conclusion> ConsistencyOf(const std::vector<SweepSummary>& summaries);

/// Returns the sentences about a sweep: the estimator with the least error, and ConsistencyOf().
std::vector<Conclusion> ConclusionsOf(const SweepResult& result,
                                      const std::vector<SweepSummary>& summaries);

/// Returns the sentences about a varied sweep: the best value of each estimator, divergence, and
/// the consistency at each value.
std::vector<Conclusion> ConclusionsOf(const VariedSweep& sweep);

}  // namespace alidade::internal
