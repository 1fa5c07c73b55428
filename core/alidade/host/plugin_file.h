// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "alidade/host/plugin_host.h"
#include "alidade/model/plugin_abi.h"

/// What PluginHost asks of a plugin file before and while opening it.
namespace alidade {

struct CppPluginTable;

namespace internal {

/// The folders of ALIDADE_PLUGIN_PATH, in its order.
std::vector<std::filesystem::path> PluginFoldersOfEnvironment();

/// A plugin that is open for the rest of the process.
struct OpenedPlugin {
  std::filesystem::path file;       ///< canonical
  const AlidadeTable* table;        ///< of a C-ABI plugin, else null
  const CppPluginTable* cpp_table;  ///< of a C++ plugin, else null
  bool unoptimised;                 ///< by its build tag
};

/// The build id that a C++ plugin must have: that of this library.
const char* HostBuildId();

[[noreturn]] inline void Refuse(const std::filesystem::path& file, const std::string& why) {
  throw Error(ExitCode::kPlugin, ErrorLine({file.string()}, {}, why));
}

/// Where the plugins of this very build lie: `lib/alidade` next to this library, of the build tree
/// or of the installation; "" where that cannot be told.
std::filesystem::path FolderOfProgram();

/// Refuses a build that this host cannot run: fast-math, instructions that this processor lacks, a
/// C++ plugin of another build. Errors: kPlugin.
void CheckBuild(const AlidadeBuildTag& build_tag, const std::filesystem::path& file);

/// The names of its entries that a file lists; none where it has no list, or not one that ends.
std::optional<std::set<std::string>> ListedNames(const std::filesystem::path& file);

/// Whether a plugin may offer an entry of one of these names: one that lists none of them does not.
bool MayOffer(const std::filesystem::path& file, const std::set<std::string>& names);

/// Examines the plugins as OpenPlugin does, and tries those that pass in one child process, one
/// after the other. They are the result; none where any has a fault there, so that each has to be
/// tried by itself.
std::set<std::filesystem::path> TryTogether(const std::set<std::filesystem::path>& files);

/// Checks build tag, build and trust, tries the plugin in a child process, opens it and walks its
/// table; of one that TryTogether has `tried` the last two alone. `canonical` is `file` behind its
/// links. Errors: kPlugin, kNotTrusted.
OpenedPlugin OpenPlugin(const std::filesystem::path& file, const std::filesystem::path& canonical,
                        bool tried = false);

/// A C++ plugin that is loaded only when it is needed.
struct PluginOnDemand {
  std::filesystem::path file;
  const CppPluginTable* table;
};

/// Opens the only plugin in `folder`, or if that is "" in `lib/alidade/NAME` next to this library.
/// Errors: kPlugin if there is none, made of `missing` and where it was searched, or more than one,
/// or one of models; those of OpenPlugin.
PluginOnDemand OpenOnDemand(const std::string& name, const std::filesystem::path& folder,
                            const std::string& missing);

/// Whether the entry is of a kind that this version knows; another is left out.
bool IsKnown(const AlidadeEntry& entry);

/// What breaks the rules of plugin_abi.h or cpp_plugin.h in a table, or "".
std::string Defect(const AlidadeTable* table);
std::string Defect(const CppPluginTable* table);

/// `sensor`, `motion model`, `source`, `estimator`.
const char* KindName(PluginEntry::Kind kind);

}  // namespace internal

struct PluginHost::Loaded : internal::OpenedPlugin {};

}  // namespace alidade
