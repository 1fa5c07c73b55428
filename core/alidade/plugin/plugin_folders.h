// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

/// Where plugins lie.
namespace alidade::internal {

/// The folders of ALIDADE_PLUGIN_PATH, in its order.
std::vector<std::filesystem::path> PluginFoldersOfEnvironment();

/// The user's own; none where there is no home folder.
std::optional<std::filesystem::path> PluginFolderOfUser();

/// The folder of the plugins of this build: `lib/alidade` next to this library, in the build tree
/// or the installation; "" if it cannot be determined.
std::filesystem::path FolderOfLibrary();

}  // namespace alidade::internal
