// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "alidade/config/config.h"
#include "alidade/estimation/models.h"

namespace alidade::internal {

/// Creates a sensor model from the expressions in its config entry; docs/formula.md describes the
/// keys. `bound_roles` are the blocks that the key `roles` binds, with the names of the roles. The
/// key `owns` adds roles, and `has_landmark` adds the role `landmark`. Error: kBadConfig.
SharedSensor CreateFormulaSensor(const Node& entry, const std::vector<Space>& bound_roles,
                                 bool has_landmark);

}  // namespace alidade::internal
