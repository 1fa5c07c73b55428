// SPDX-License-Identifier: Apache-2.0
#include "alidade/io/near_file.h"

#include <algorithm>
#include <vector>

#include "alidade/base/error.h"

namespace alidade::internal {
namespace fs = std::filesystem;

std::string NearFile(const fs::path& file) {
  constexpr std::size_t kMaxFiles = 10'000;
  const fs::path folder = file.parent_path();
  std::vector<std::string> names;
  std::error_code error;
  if (fs::exists(file, error)) return {};  // the file itself cannot be read
  fs::directory_iterator entries(folder.empty() ? "." : folder, error);
  for (; !error && entries != fs::directory_iterator() && names.size() < kMaxFiles;
       entries.increment(error)) {
    const fs::path& path = entries->path();
    if (path.extension() == file.extension() && entries->is_regular_file(error))
      names.push_back(path.stem().string());
  }
  std::ranges::sort(names);
  const std::string nearest = Nearest(file.stem().string(), names);
  return nearest.empty() ? "" : (folder / (nearest + file.extension().string())).string();
}

std::string ConfigIn(const fs::path& folder) {
  std::error_code error;
  const fs::path config = folder / "config.yaml";
  return fs::is_regular_file(config, error) ? config.string() : "";
}

}  // namespace alidade::internal
