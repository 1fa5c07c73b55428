// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

/// Folders of plugins.
namespace alidade::internal {

/// Returns the folders that the environment variable ALIDADE_PLUGIN_PATH lists, in their order.
std::vector<std::filesystem::path> PluginFoldersOfEnvironment();

/// Returns the plugin folder of the user. Returns nullopt if the user has no home folder.
std::optional<std::filesystem::path> PluginFolderOfUser();

/// Returns the folder of the plugins of this build: `lib/alidade` next to this library, in the
/// build tree or the installation. Returns "" if the folder cannot be determined.
std::filesystem::path FolderOfLibrary();

}  // namespace alidade::internal
