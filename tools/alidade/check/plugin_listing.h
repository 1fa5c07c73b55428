// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "alidade/plugin/plugin_host.h"

namespace alidade {

/// Lists the name, the kind and the description of each available model, source and estimator. If
/// `files` is true, the list also contains the plugin file.
std::string PluginList(const PluginHost& host, bool files = false);
/// Returns the same list as a JSON array of objects with `name`, `kind`, `family`, `doc`,
/// `citation`, `file`.
std::string PluginListJson(const PluginHost& host);

/// Describes the models, sources and estimators with the given name: description, citation,
/// measured or moved quantities, and all parameters. Error: kPlugin if the name is unknown.
std::string PluginInfo(const PluginHost& host, const std::string& name);
/// Returns the same description as a JSON array of objects. An object has the keys of
/// PluginListJson(), `describes` (a list of lines) and `parameters` (a list of objects with `key`,
/// `unit`, `type`, `range`, `choices`, `when`, `doc`, and `default` unless the parameter is
/// required). For an entry that is part of the program, `file` and `describes` are empty.
std::string PluginInfoJson(const PluginHost& host, const std::string& name);

namespace internal {

/// Returns the keys of an entry. Returns an empty list if there is no such entry.
std::vector<ParamInfo> KeysOf(const PluginHost& host, const std::string& kind,
                              const std::string& name);

}  // namespace internal

}  // namespace alidade
