// SPDX-License-Identifier: Apache-2.0
#include "alidade/plugin/plugin_folders.h"

#include <dlfcn.h>

#include <algorithm>
#include <cstdlib>
#include <string>

#include "alidade/plugin/abi_read.h"

namespace alidade::internal {
namespace fs = std::filesystem;

std::vector<fs::path> PluginFoldersOfEnvironment() {
  std::vector<fs::path> folders;
  std::string remaining = Text(secure_getenv("ALIDADE_PLUGIN_PATH"));
  while (!remaining.empty()) {
    const std::size_t colon = std::min(remaining.find(':'), remaining.size());
    if (colon > 0) folders.emplace_back(remaining.substr(0, colon));
    remaining.erase(0, colon + 1);
  }
  return folders;
}

std::optional<fs::path> PluginFolderOfUser() {
  const fs::path data = Text(secure_getenv("XDG_DATA_HOME"));
  if (data.is_absolute()) return data / "alidade/plugins";
  const fs::path home = Text(secure_getenv("HOME"));
  if (home.is_absolute()) return home / ".local/share/alidade/plugins";
  return std::nullopt;
}

fs::path FolderOfLibrary() {
  Dl_info info{};
  const auto* function = reinterpret_cast<const void*>(&FolderOfLibrary);
  if (dladdr(function, &info) == 0 || info.dli_fname == nullptr) return {};
  std::error_code error;
  const fs::path library = fs::canonical(info.dli_fname, error);
  return error ? fs::path() : library.parent_path() / "alidade";
}

}  // namespace alidade::internal
