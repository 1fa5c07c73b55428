// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

struct evp_md_ctx_st;  // a type of OpenSSL

namespace alidade::internal {

/// SHA-256 hash (FIPS 180-4) of bytes that are added in several parts. OpenSSL computes the hash in
/// constant memory.
class Sha256Stream {
 public:
  Sha256Stream();
  void Add(std::string_view bytes);
  /// Returns 64 hexadecimal digits for the bytes added so far. More bytes may follow.
  std::string Digest() const;

 private:
  struct Deleter {
    void operator()(evp_md_ctx_st* context) const;
  };
  std::unique_ptr<evp_md_ctx_st, Deleter> context_;
};

/// Returns the SHA-256 of `bytes` as 64 hexadecimal digits.
std::string Sha256(std::string_view bytes);
/// Returns the SHA-256 of a file's bytes; "" if the file cannot be read.
std::string Sha256OfFile(const std::filesystem::path& file);

}  // namespace alidade::internal
