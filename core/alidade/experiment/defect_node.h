// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/config/config.h"
#include "alidade/estimation/support.h"

namespace alidade::internal {

/// The node of the config `root`, of which `system` was made, that a defect of it is about.
Node NodeOf(const ProblemDefect& defect, const Node& root, const System& system);

}  // namespace alidade::internal
