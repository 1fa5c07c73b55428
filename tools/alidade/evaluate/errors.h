// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>
#include <vector>

#include "alidade/evaluate/evaluate.h"

namespace alidade::internal {

/// Computes the error of each pose. Both trajectories must have the same number of matched poses,
/// in the same world.
PoseErrors AbsoluteErrors(PoseRelation relation, const Trajectory& reference,
                          const Trajectory& estimate);
/// Computes the error of each pair of poses.
PoseErrors RelativeErrors(PoseRelation relation, const Trajectory& reference,
                          const Trajectory& estimate,
                          const std::vector<std::pair<int, int>>& pairs);

}  // namespace alidade::internal
