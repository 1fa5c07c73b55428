// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>

namespace alidade::internal {

/// Callback that FollowLinks calls before it resolves a part of a path. `entry` is the path of the
/// part, and `folder` is the resolved folder that contains the part. `is_last` is true for the last
/// part of the path.
using PathVisitor = std::function<void(const std::filesystem::path& folder,
                                       const std::filesystem::path& entry, bool is_last)>;

/// Resolves all symbolic links of the absolute `path`, part by part from the root. The target of a
/// link need not exist. Returns "" after more than 40 links, or if a link cannot be read.
std::filesystem::path FollowLinks(const std::filesystem::path& path,
                                  const PathVisitor& visit = nullptr);

}  // namespace alidade::internal
