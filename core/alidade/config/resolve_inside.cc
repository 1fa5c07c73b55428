// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <vector>

#include "alidade/config/tree.h"

namespace alidade {
namespace fs = std::filesystem;
namespace {

/// `path` with every symlink followed, also one to nothing; empty where they are endless.
fs::path Followed(const fs::path& path) {
  constexpr int kMaxLinks = 40;
  const fs::path absolute = fs::absolute(path);
  std::vector<fs::path> todo(absolute.begin(), absolute.end());
  std::reverse(todo.begin(), todo.end());
  fs::path done;
  for (int links = 0; !todo.empty();) {
    const fs::path part = todo.back();
    todo.pop_back();
    if (part.empty() || part == ".") continue;
    if (part.is_absolute()) {
      done = part;
    } else if (part == "..") {
      done = done.parent_path();
    } else if (std::error_code error; fs::is_symlink(fs::symlink_status(done / part, error))) {
      const fs::path target = fs::read_symlink(done / part, error);
      if (error || ++links > kMaxLinks) return {};
      std::vector<fs::path> parts(target.begin(), target.end());
      todo.insert(todo.end(), parts.rbegin(), parts.rend());
    } else {
      done /= part;
    }
  }
  return done;
}

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
    internal::FailAt(place, key, "empty path", "a path");
  }
  if (allow_outside) return joined;
  const fs::path inside = Followed(folder);
  const fs::path target = Followed(joined);
  if (inside.empty() || target.empty() || !Contains(inside, target)) {
    throw Error(ExitCode::kNotTrusted,
                ErrorLine(place, key, internal::Quoted(path) + " leaves its folder",
                          "a path inside " + internal::Quoted(folder.string())));
  }
  return joined;
}

}  // namespace alidade
