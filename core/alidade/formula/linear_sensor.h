// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "alidade/config/config.h"
#include "alidade/estimation/models.h"

namespace alidade::internal {

/// Creates a linear sensor model from the matrices in its config entry; docs/formula.md describes
/// the keys. `bound_roles` are the blocks that the key `roles` binds, with the names of the roles.
/// The key `owns` adds roles. Error: kBadConfig.
SharedSensor CreateLinearSensor(const Node& entry, const std::vector<Space>& bound_roles);

}  // namespace alidade::internal
