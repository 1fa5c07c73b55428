// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

namespace alidade {

/// Refuses a file that someone else could have written, and a path that is not absolute. The file
/// and its parent folders must be owned by root, the caller or the owner of the running program.
/// Neither everyone nor a group may have write permission. Exceptions are sticky parent folders,
/// and the caller's private group, which has the caller's name and no other member. Follows
/// symbolic links and checks each folder on the way. Errors: kNotTrusted.
void CheckTrusted(const std::filesystem::path& file);

}  // namespace alidade
