// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>

namespace alidade::internal {

/// Function that is called with each entry of a folder before it is followed. `is_last` is true for
/// the last part of the path.
using PathVisitor = std::function<void(const std::filesystem::path& folder,
                                       const std::filesystem::path& entry, bool is_last)>;

/// Resolves the absolute `path` part by part from the root, with all symbolic links, including
/// dangling ones. Returns "" after more than 40 links, or if a link cannot be read.
std::filesystem::path FollowLinks(const std::filesystem::path& path,
                                  const PathVisitor& visit = nullptr);

}  // namespace alidade::internal
