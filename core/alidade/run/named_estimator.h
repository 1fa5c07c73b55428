// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "alidade/run/run.h"

namespace alidade::internal {

/// Makes the entry `name` of the config's `estimators:` and puts it behind those that the
/// experiment has; nothing is added where that fails. Errors: those of BuildExperiment.
void AddEstimator(const Config& config, const PluginHost& host, const std::string& name,
                  Experiment& experiment);

}  // namespace alidade::internal
