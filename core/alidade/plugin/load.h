// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "alidade/model/plugin_abi.h"
#include "alidade/plugin/cpp_plugin.h"

namespace alidade::internal {

/// Loaded plugin. It remains loaded until the process ends.
struct LoadedPlugin {
  std::filesystem::path file;       ///< path without symbolic links
  const AlidadeTable* table;        ///< table of a C-ABI plugin, else null
  const CppPluginTable* cpp_table;  ///< table of a C++ plugin, else null
};

/// Checks whether `file` is trusted and its build tag is compatible, loads the plugin and checks
/// its table. `canonical` is `file` with its symbolic links resolved. Errors: kPlugin, kNotTrusted.
LoadedPlugin LoadPlugin(const std::filesystem::path& file, const std::filesystem::path& canonical);

/// Loads the only plugin in `folder`, or in `lib/alidade/NAME` next to this library if `folder` is
/// "". Returns the factory of the plugin's first entry, which must be of the kind `kind`. Errors:
/// the errors of LoadPlugin; kPlugin if the folder contains more than one plugin, a plugin of
/// another kind, or no plugin. If there is no plugin, the message contains `missing` and the
/// searched folder.
const void* FactoryOnDemand(const std::string& kind, const std::string& name,
                            const std::filesystem::path& folder, const std::string& missing);

}  // namespace alidade::internal
