// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "alidade/model/plugin_abi.h"
#include "alidade/plugin/plugin_host.h"

/// Checks of plugin files before and during loading.
namespace alidade {

struct CppPluginTable;

/// The build tag in the `.alidade` section of a plugin, read from its bytes. Errors: kPlugin (no
/// build tag, a malformed one, another plugin ABI).
AlidadeBuildTag ReadBuildTag(const std::filesystem::path& file);

/// Refuses a file that someone else could have written: not absolute; it, its folder or a folder
/// above it owned by another than root, the caller or the owner of the running program; writable
/// for the world (sticky folders above excepted) or for a group other than the caller's private
/// one, which has the caller's name and no other member. Follows symbolic links and checks each
/// folder on the way. Errors: kNotTrusted.
void CheckTrusted(const std::filesystem::path& file);

namespace internal {

/// The folders of ALIDADE_PLUGIN_PATH, in its order.
std::vector<std::filesystem::path> PluginFoldersOfEnvironment();

/// A plugin that is open for the rest of the process.
struct OpenedPlugin {
  std::filesystem::path file;       ///< canonical
  const AlidadeTable* table;        ///< of a C-ABI plugin, else null
  const CppPluginTable* cpp_table;  ///< of a C++ plugin, else null
};

[[noreturn]] inline void Refuse(const std::filesystem::path& file, const std::string& why) {
  throw Error(ExitCode::kPlugin, ErrorLine({file.string()}, {}, why));
}

/// The folder of the plugins of this build: `lib/alidade` next to this library, in the build tree
/// or the installation; "" if it cannot be determined.
std::filesystem::path FolderOfProgram();

/// False if the plugin lists the names of its entries and none of `names` is among them. Such a
/// plugin may stay closed.
bool MayOffer(const std::filesystem::path& file, const std::set<std::string>& names);

/// Checks trust and build tag, opens the plugin and checks its table. `canonical` is `file` with
/// its symbolic links resolved. Errors: kPlugin, kNotTrusted.
OpenedPlugin OpenPlugin(const std::filesystem::path& file, const std::filesystem::path& canonical);

/// Opens the only plugin in `folder`, or if that is "" in `lib/alidade/NAME` next to this library,
/// and returns the factory of its first entry, of the kind `kind`. Errors: kPlugin if there is no
/// plugin, made of `missing` and where it was searched, or more than one, or one of another kind;
/// those of OpenPlugin.
const void* FactoryOnDemand(const std::string& kind, const std::string& name,
                            const std::filesystem::path& folder, const std::string& missing);

/// Whether the entry is of a kind that this version knows; another is left out.
bool IsKnown(const AlidadeEntry& entry);

/// What breaks the rules of plugin_abi.h or cpp_plugin.h in a table, or "".
std::string Defect(const AlidadeTable* table);
std::string Defect(const CppPluginTable* table);

}  // namespace internal

}  // namespace alidade
