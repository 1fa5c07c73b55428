// SPDX-License-Identifier: Apache-2.0
#include "alidade/config/data_paths.h"

#include <filesystem>

namespace alidade::internal {
namespace {

/// Returns the path of a source or of one of its files; "" if it has no path.
std::string PathIn(const ConfigTree& map) {
  const ConfigTree* const path = Child(map, "path");
  return path != nullptr && path->kind == Node::Kind::kScalar ? path->text : "";
}

}  // namespace

std::vector<std::string> DataPaths(const ConfigTree& root) {
  std::vector<std::string> paths;
  const ConfigTree* const source = Child(root, "source");
  if (source == nullptr) return paths;
  const std::string folder = PathIn(*source);
  const ConfigTree* const files = Child(*source, "files");
  if (files == nullptr) {
    if (!folder.empty()) paths.push_back(folder);
    return paths;
  }
  for (const auto& file : files->children) {
    const std::string path = PathIn(*file);
    if (path.empty()) continue;
    paths.push_back(path == "-" ? path : (std::filesystem::path(folder) / path).string());
  }
  return paths;
}

}  // namespace alidade::internal
