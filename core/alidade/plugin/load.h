// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "alidade/model/plugin_abi.h"
#include "alidade/plugin/cpp_plugin.h"

namespace alidade::internal {

/// A plugin that is open for the rest of the process.
struct OpenedPlugin {
  std::filesystem::path file;       ///< canonical
  const AlidadeTable* table;        ///< of a C-ABI plugin, else null
  const CppPluginTable* cpp_table;  ///< of a C++ plugin, else null
};

/// Checks trust and build tag, opens the plugin and checks its table. `canonical` is `file` with
/// its symbolic links resolved. Errors: kPlugin, kNotTrusted.
OpenedPlugin OpenPlugin(const std::filesystem::path& file, const std::filesystem::path& canonical);

/// Opens the only plugin in `folder`, or if that is "" in `lib/alidade/NAME` next to this library,
/// and returns the factory of its first entry, of the kind `kind`. Errors: kPlugin if there is no
/// plugin, made of `missing` and where it was searched, or more than one, or one of another kind;
/// those of OpenPlugin.
const void* FactoryOnDemand(const std::string& kind, const std::string& name,
                            const std::filesystem::path& folder, const std::string& missing);

}  // namespace alidade::internal
