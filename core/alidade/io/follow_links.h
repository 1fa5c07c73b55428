// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>

namespace alidade::internal {

/// Sees an entry of a folder before it is followed; `last` if no other part of the path comes.
using PathVisitor = std::function<void(const std::filesystem::path& folder,
                                       const std::filesystem::path& entry, bool last)>;

/// Where the absolute `path` leads, part by part from the root, with every symbolic link on the way
/// followed, also one to nothing. "" beyond 40 links, or if one cannot be read.
std::filesystem::path FollowLinks(const std::filesystem::path& path,
                                  const PathVisitor& visit = nullptr);

}  // namespace alidade::internal
