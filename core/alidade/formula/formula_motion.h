// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/config/config.h"
#include "alidade/estimation/models.h"

namespace alidade::internal {

/// Creates a motion model from the expressions in its config entry; docs/formula.md describes the
/// keys. Error: kBadConfig.
SharedMotion CreateFormulaMotion(const Node& entry);

}  // namespace alidade::internal
