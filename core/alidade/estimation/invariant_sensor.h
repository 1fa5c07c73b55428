// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "alidade/estimation/invariant_group.h"
#include "alidade/estimation/models.h"

namespace alidade::internal {

/// Role of a sensor model in an InvariantSensor.
struct RoleSource {
  int role;         ///< role of the InvariantSensor; -1: the role has no block
  int member = -1;  ///< index of the block in the group; -1: the block is not in the group
};

/// Creates a sensor model with the given roles, of which `element_role` is the group element.
/// `sources` describes each role of `sensor`.
SharedSensor MakeInvariantSensor(SharedSensor sensor, const GroupBlock& group,
                                 std::vector<RoleSource> sources, std::vector<Space> roles,
                                 int element_role);

}  // namespace alidade::internal
