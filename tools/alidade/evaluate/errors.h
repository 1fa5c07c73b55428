// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>
#include <vector>

#include "alidade/evaluate/evaluate.h"

namespace alidade::internal {

/// Of each pose; both trajectories have the same ones, in one world.
PoseErrors AbsoluteErrors(PoseRelation relation, const Trajectory& reference,
                          const Trajectory& estimate);
/// Of each pair.
PoseErrors RelativeErrors(PoseRelation relation, const Trajectory& reference,
                          const Trajectory& estimate,
                          const std::vector<std::pair<int, int>>& pairs);

}  // namespace alidade::internal
