// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/config/config.h"
#include "alidade/estimation/models.h"

namespace alidade::internal {

/// Creates a linear motion model from the matrices in its config entry; docs/formula.md describes
/// the keys. Error: kBadConfig.
SharedMotion CreateLinearMotion(const Node& entry);

}  // namespace alidade::internal
