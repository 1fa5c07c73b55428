// SPDX-License-Identifier: Apache-2.0
#include "alidade/io/follow_links.h"

#include <algorithm>
#include <system_error>
#include <vector>

namespace alidade::internal {

namespace fs = std::filesystem;

fs::path FollowLinks(const fs::path& path, const PathVisitor& visit) {
  constexpr int kMaxLinks = 40;
  std::vector<fs::path> todo;  // the next part last
  const auto push = [&](const fs::path& added) {
    std::vector<fs::path> parts(added.begin(), added.end());
    std::erase_if(parts, [](const fs::path& part) { return part.empty() || part == "."; });
    todo.insert(todo.end(), parts.rbegin(), parts.rend());
  };
  push(path);
  fs::path at;
  for (int links = 0; !todo.empty();) {
    const fs::path part = todo.back();
    todo.pop_back();
    if (part.is_absolute()) {
      at = part;
      continue;
    }
    if (part == "..") {
      at = at.parent_path();
      continue;
    }
    const fs::path entry = at / part;
    if (visit) visit(at, entry, todo.empty());
    std::error_code error;
    if (!fs::is_symlink(fs::symlink_status(entry, error))) {
      at = entry;
      continue;
    }
    const fs::path target = fs::read_symlink(entry, error);
    if (error || ++links > kMaxLinks) return {};
    push(target);
  }
  return at;
}

}  // namespace alidade::internal
