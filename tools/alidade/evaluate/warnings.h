// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "alidade/evaluate/evaluate.h"

namespace alidade::internal {

/// What makes the figures of an evaluation mean something else than they say. `matches` are the
/// poses of `reference` and `estimate`, as they were read, that the evaluation is of.
std::vector<std::string> EvaluationWarnings(const Evaluation& evaluation, const Matches& matches,
                                            const Trajectory& reference,
                                            const Trajectory& estimate);

}  // namespace alidade::internal
