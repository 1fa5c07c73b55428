// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "alidade/plugin/plugin_host.h"

namespace alidade {

/// Lists the available models, sources and estimators: name, kind, doc and, with `files`, the file.
std::string PluginList(const PluginHost& host, bool files = false);
/// Returns the list as a JSON array of objects with `name`, `kind`, `family`, `doc`, `citation`,
/// `file`.
std::string PluginListJson(const PluginHost& host);

/// Describes the plugin entries and the built-in estimator (`ekf`, `rts`, ...) with a name: doc,
/// citation, measured or moved quantities, and every parameter. Error: kPlugin if there is no such
/// name.
std::string PluginInfo(const PluginHost& host, const std::string& name);
/// Returns the description as a JSON array: the keys of PluginListJson, `describes` (lines) and
/// `parameters` (objects with `key`, `unit`, `type`, `range`, `default` if any, `choices`, `when`,
/// `doc`). A built-in estimator has no `family`, `citation`, `file` and `describes`.
std::string PluginInfoJson(const PluginHost& host, const std::string& name);

}  // namespace alidade
