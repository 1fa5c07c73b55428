// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/config/config.h"
#include "alidade/estimation/estimator_capabilities.h"

namespace alidade::internal {

/// The node of the config `root`, of which `problem` was made, that a defect of it is about.
Node NodeOf(const ProblemDefect& defect, const Node& root, const Problem& problem);

}  // namespace alidade::internal
