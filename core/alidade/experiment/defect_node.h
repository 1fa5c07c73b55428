// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/config/config.h"
#include "alidade/estimation/estimator_capabilities.h"

namespace alidade::internal {

/// Returns the node of a config that causes a defect of `problem`. The problem was read from the
/// config, whose root is `root`.
Node FindDefectNode(const ProblemDefect& defect, const Node& root, const Problem& problem);

}  // namespace alidade::internal
