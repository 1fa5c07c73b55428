// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

struct evp_md_ctx_st;  // of OpenSSL

namespace alidade::internal {

/// SHA-256 of bytes that come piece by piece, in constant memory. (FIPS 180-4, by OpenSSL)
class Sha256Stream {
 public:
  Sha256Stream();
  void Add(std::string_view bytes);
  /// 64 hexadecimal digits of all that was added so far; more may follow.
  std::string Digest() const;

 private:
  struct Free {
    void operator()(evp_md_ctx_st* context) const;
  };
  std::unique_ptr<evp_md_ctx_st, Free> context_;
};

/// SHA-256 as 64 hexadecimal digits.
std::string Sha256(std::string_view bytes);
/// Of a file's bytes; "" where it cannot be read.
std::string Sha256OfFile(const std::filesystem::path& file);

}  // namespace alidade::internal
