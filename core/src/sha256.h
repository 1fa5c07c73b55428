// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace alidade::internal {

/// SHA-256 as 64 hexadecimal digits. (FIPS 180-4)
std::string Sha256(std::string_view bytes);
/// Of a file's bytes; "" where it cannot be read.
std::string Sha256OfFile(const std::filesystem::path& file);

}  // namespace alidade::internal
