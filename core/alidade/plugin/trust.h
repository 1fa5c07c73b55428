// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

namespace alidade {

/// Refuses a file that someone else could have written: not absolute; it, its folder or a folder
/// above it owned by another than root, the caller or the owner of the running program; writable
/// for the world (sticky folders above excepted) or for a group other than the caller's private
/// one, which has the caller's name and no other member. Follows symbolic links and checks each
/// folder on the way. Errors: kNotTrusted.
void CheckTrusted(const std::filesystem::path& file);

}  // namespace alidade
