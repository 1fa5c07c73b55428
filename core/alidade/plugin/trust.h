// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

namespace alidade {

/// Refuses a file that someone else could have written, and a path that is not absolute. The file
/// and its parent folders must be owned by root, the caller or the owner of the running program.
/// Neither everyone nor a group may have write permission. There are two exceptions: sticky parent
/// folders may be writable, and so may files and folders for the caller's private group. A private
/// group has the caller's name and no other member. Follows symbolic links and checks each folder
/// on the path. Errors: kNotTrusted.
void CheckTrusted(const std::filesystem::path& file);

}  // namespace alidade
