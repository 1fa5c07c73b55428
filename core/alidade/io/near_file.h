// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

/// Suggestions for the path of a file that cannot be read.
namespace alidade::internal {

/// Returns the file in the folder of `file` that has the same extension and the most similar name.
/// Returns "" if `file` exists, or if no file is similar enough.
std::string NearFile(const std::filesystem::path& file);

/// Returns `folder/config.yaml` if this file exists, else "".
std::string ConfigIn(const std::filesystem::path& folder);

}  // namespace alidade::internal
