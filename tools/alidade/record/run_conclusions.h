// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "alidade/experiment/run.h"
#include "alidade/record/estimate_history.h"
#include "alidade/report/conclusion.h"

namespace alidade::internal {

/// Returns the sentences about a run that its verdicts, findings and events do not contain:
/// excursions of errors outside 3 sigma, sudden decreases of sigma, the least error, the errors in
/// segments, the error at the end of the path, and the errors of the maps. `histories` contains the
/// history of each estimator, or nothing.
std::vector<Conclusion> ConclusionsOf(const RunResult& result,
                                      const std::vector<EstimateHistory>& histories);

}  // namespace alidade::internal
