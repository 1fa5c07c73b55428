// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "alidade/plugin/plugin_host.h"

namespace alidade {

/// Lists the name, the kind and the doc of each available model, source and estimator. If `files`,
/// the list also contains the file.
std::string PluginList(const PluginHost& host, bool files = false);
/// Returns the same list as a JSON array of objects with `name`, `kind`, `family`, `doc`,
/// `citation`, `file`.
std::string PluginListJson(const PluginHost& host);

/// Describes the plugin entries and the built-in estimator (`ekf`, `rts`, ...) with the given name:
/// doc, citation, measured or moved quantities, and all parameters. Error: kPlugin if the name is
/// unknown.
std::string PluginInfo(const PluginHost& host, const std::string& name);
/// Returns the same description as a JSON array: the keys of PluginListJson, `describes` (lines)
/// and `parameters` (objects with `key`, `unit`, `type`, `range`, `default` if any, `choices`,
/// `when`, `doc`). A built-in estimator has no `family`, `citation`, `file` and `describes`.
std::string PluginInfoJson(const PluginHost& host, const std::string& name);

}  // namespace alidade
