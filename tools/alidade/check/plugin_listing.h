// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "alidade/plugin/plugin_host.h"

namespace alidade {

/// The models, sources and estimators on offer: name, kind, doc and, with `files`, the file.
std::string PluginList(const PluginHost& host, bool files = false);
/// The same, with files, as a JSON array of objects with `name`, `kind`, `family`, `doc`,
/// `citation`, `file`.
std::string PluginListJson(const PluginHost& host);

/// All there is to know of the entries called `name`: doc, citation, what they measure or move, and
/// every parameter; also of the types of estimators that core has (`ekf`, `rts`, ...). Error:
/// kPlugin where there is none.
std::string PluginInfo(const PluginHost& host, const std::string& name);
/// The same as a JSON array: the keys of PluginListJson, `describes` (lines) and `parameters`
/// (objects with `key`, `unit`, `type`, `range`, `default` where there is one, `choices`, `when`,
/// `doc`). A built-in estimator has no `family`, `citation`, `file` and `describes`.
std::string PluginInfoJson(const PluginHost& host, const std::string& name);

}  // namespace alidade
