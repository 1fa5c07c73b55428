// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "alidade/estimation/invariant_group.h"
#include "alidade/estimation/models.h"

namespace alidade::internal {

/// Creates the motion model of a group element from that of its blocks. `members` contains the
/// index of each block of `model` in the group, or -1. `element` is the first block of the result.
SharedMotion MakeInvariantMotion(SharedMotion model, const GroupBlock& group,
                                 std::vector<int> members, const Space& element);

}  // namespace alidade::internal
