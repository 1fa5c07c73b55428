// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "alidade/evaluate/evaluate.h"

namespace alidade::internal {

/// Returns warnings of conditions under which the results of an evaluation are misleading.
/// `reference` and `estimate` are the trajectories as read from files. `matches` contains the
/// indices of the evaluated poses.
std::vector<std::string> EvaluationWarnings(const Evaluation& evaluation, const Matches& matches,
                                            const Trajectory& reference,
                                            const Trajectory& estimate);

/// Returns the remedy, followed by `; or `, if the timestamps of only one trajectory may be numbers
/// of frames. Otherwise returns "".
std::string FrameNumberRemedy(const Trajectory& reference, const Trajectory& estimate);

}  // namespace alidade::internal
