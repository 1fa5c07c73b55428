// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "alidade/config/config.h"
#include "alidade/estimation/problem.h"
#include "alidade/plugin/plugin_host.h"

namespace alidade {

/// Reads `state`, `sensors`, `landmarks`, `camera` and `initial_time_s` of a config's root. `only`
/// keeps named sensors, in its own order, and the state entries that they touch; empty: everything.
/// Errors: kBadConfig with place and remedy, kPlugin.
Problem ReadProblem(const Node& root, const PluginHost& host, const std::vector<std::string>& only);

}  // namespace alidade
