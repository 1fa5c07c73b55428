// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "alidade/experiment/run.h"

namespace alidade {

/// Describes `experiment`, which was built from `config`, without running it. For each estimator
/// the text lists the blocks and their initial values, the motion models and the sensors. It also
/// lists the unobservable directions of the state, the options and the capabilities.
std::string Explain(const Config& config, const Experiment& experiment);

}  // namespace alidade
