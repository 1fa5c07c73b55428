// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "alidade/experiment/run.h"

namespace alidade {

/// Describes `experiment`, which was built from `config`, before it is run. For each estimator: its
/// blocks and their initial values, its motion models and sensors, unobservable directions of the
/// state, options, and capabilities.
std::string Explain(const Config& config, const Experiment& experiment);

}  // namespace alidade
