// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>

namespace alidade::internal {

/// Function that is called with each part of a path before that part is resolved: `entry` in
/// `folder`. `is_last` is true for the last part of the path.
using PathVisitor = std::function<void(const std::filesystem::path& folder,
                                       const std::filesystem::path& entry, bool is_last)>;

/// Resolves all symbolic links of the absolute `path`, part by part from the root. Resolves
/// dangling links too. Returns "" after more than 40 links, or if a link cannot be read.
std::filesystem::path FollowLinks(const std::filesystem::path& path,
                                  const PathVisitor& visit = nullptr);

}  // namespace alidade::internal
