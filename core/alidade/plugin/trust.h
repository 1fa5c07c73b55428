// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

namespace alidade {

/// Refuses a file that someone else could have written, and a path that is not absolute. The file
/// and its parent folders must be owned by root, the caller or the owner of the running program.
/// Neither a group nor all users may have write permission. There are two exceptions: a sticky
/// parent folder may be writable by anyone, and the private group of the caller may have write
/// permission. A private group has the name of the caller and no other member. Follows symbolic
/// links and checks each folder on the path. Error: kNotTrusted.
void CheckTrusted(const std::filesystem::path& file);

}  // namespace alidade
