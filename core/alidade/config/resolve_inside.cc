// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "alidade/config/tree.h"
#include "alidade/io/follow_links.h"

namespace alidade {
namespace fs = std::filesystem;
namespace {

bool Contains(const fs::path& folder, const fs::path& path) {
  return std::mismatch(folder.begin(), folder.end(), path.begin(), path.end()).first ==
         folder.end();
}

}  // namespace

fs::path ResolveInside(const fs::path& base, const std::string& path, bool allow_outside,
                       const Place& place, std::string_view key) {
  const fs::path folder = base.empty() ? fs::path(".") : base;
  const fs::path joined = base / path;
  if (path.empty() || path.find('\0') != std::string::npos) {
    internal::FailAt(place, key, "the path is empty", "a path");
  }
  if (allow_outside) return joined;
  const fs::path inside = internal::FollowLinks(fs::absolute(folder));
  const fs::path target = internal::FollowLinks(fs::absolute(joined));
  if (inside.empty() || target.empty() || !Contains(inside, target)) {
    throw Error(ExitCode::kNotTrusted,
                ErrorLine(place, key, internal::Quoted(path) + " is outside the permitted folder",
                          "a path inside " + internal::Quoted(folder.string())));
  }
  return joined;
}

}  // namespace alidade
