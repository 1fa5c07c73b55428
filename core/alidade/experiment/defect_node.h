// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/config/config.h"
#include "alidade/estimation/estimator_capabilities.h"

namespace alidade::internal {

/// Returns the node of the config `root` that causes a defect of `problem`, which was read from it.
Node FindDefectNode(const ProblemDefect& defect, const Node& root, const Problem& problem);

}  // namespace alidade::internal
