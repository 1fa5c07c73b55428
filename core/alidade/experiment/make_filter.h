// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "alidade/config/config.h"
#include "alidade/estimation/filter.h"
#include "alidade/plugin/plugin_host.h"

namespace alidade {

/// The filter that the entry `name` of a config's `estimators:` describes, for live use: the config
/// needs no `source:`; keys of a run, such as `source` or `on_divergence`, have no effect. The
/// filter's streams are those that its sensors and control inputs name. Errors: those of
/// BuildExperiment, and kBadConfig where the entry is not there or its type is not a recursive
/// filter of core.
std::unique_ptr<Filter> MakeFilter(const Config& config, const PluginHost& host,
                                   const std::string& name);

}  // namespace alidade
