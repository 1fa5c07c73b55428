// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>
#include <vector>

#include "alidade/evaluate/evaluate.h"

namespace alidade::internal {

/// Computes the error of each pose. Pose i of both trajectories must match, and both must be in the
/// same world frame.
PoseErrors AbsoluteErrors(PoseRelation relation, const Trajectory& reference,
                          const Trajectory& estimate);
/// Computes the error of each pair of poses.
PoseErrors RelativeErrors(PoseRelation relation, const Trajectory& reference,
                          const Trajectory& estimate,
                          const std::vector<std::pair<int, int>>& pairs);

}  // namespace alidade::internal
