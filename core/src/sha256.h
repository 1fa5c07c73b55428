// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace alidade::internal {

/// SHA-256 of bytes that come piece by piece, in constant memory. (FIPS 180-4)
class Sha256Stream {
 public:
  void Add(std::string_view bytes);
  /// 64 hexadecimal digits of all that was added so far; more may follow.
  std::string Digest() const;

 private:
  std::array<std::uint32_t, 8> hash_ = {0x6a09e667, 0xbb67ae85, 0x3c6ef372, 0xa54ff53a,
                                        0x510e527f, 0x9b05688c, 0x1f83d9ab, 0x5be0cd19};
  std::string tail_;  ///< less than a block
  std::uint64_t size_ = 0;
};

/// SHA-256 as 64 hexadecimal digits.
std::string Sha256(std::string_view bytes);
/// Of a file's bytes; "" where it cannot be read.
std::string Sha256OfFile(const std::filesystem::path& file);

}  // namespace alidade::internal
