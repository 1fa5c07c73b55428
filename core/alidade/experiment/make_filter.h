// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "alidade/config/config.h"
#include "alidade/estimation/filter.h"
#include "alidade/plugin/plugin_host.h"

namespace alidade {

/// Creates the filter of the entry `name` of `estimators:`, for live use. The config does not need
/// a `source:`. Keys that only a run uses, such as `source` or `on_divergence`, have no effect. The
/// streams of the filter are those that its sensors and control inputs name. Errors: those of
/// BuildExperiment, and kBadConfig if the entry does not exist or its type is not a built-in
/// recursive filter.
std::unique_ptr<Filter> MakeFilter(const Config& config, const PluginHost& host,
                                   const std::string& name);

}  // namespace alidade
