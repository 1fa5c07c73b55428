// SPDX-License-Identifier: Apache-2.0
#include "alidade/io/follow_links.h"

#include <algorithm>
#include <system_error>
#include <vector>

namespace alidade::internal {

namespace fs = std::filesystem;

fs::path FollowLinks(const fs::path& path, const PathVisitor& visit) {
  constexpr int kMaxLinks = 40;
  std::vector<fs::path> pending;  // unresolved parts, in reverse order
  const auto push = [&](const fs::path& added) {
    std::vector<fs::path> parts(added.begin(), added.end());
    std::erase_if(parts, [](const fs::path& part) { return part.empty() || part == "."; });
    pending.insert(pending.end(), parts.rbegin(), parts.rend());
  };
  push(path);
  fs::path resolved;
  for (int links = 0; !pending.empty();) {
    const fs::path part = pending.back();
    pending.pop_back();
    if (part.is_absolute()) {
      resolved = part;
      continue;
    }
    if (part == "..") {
      resolved = resolved.parent_path();
      continue;
    }
    const fs::path entry = resolved / part;
    if (visit) visit(resolved, entry, pending.empty());
    std::error_code error;
    if (!fs::is_symlink(fs::symlink_status(entry, error))) {
      resolved = entry;
      continue;
    }
    const fs::path target = fs::read_symlink(entry, error);
    if (error || ++links > kMaxLinks) return {};
    push(target);
  }
  return resolved;
}

}  // namespace alidade::internal
