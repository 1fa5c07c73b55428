// SPDX-License-Identifier: Apache-2.0
#include "alidade/io/sha256.h"

#include <openssl/evp.h>

#include <array>
#include <cerrno>
#include <fstream>
#include <new>

namespace alidade::internal {
namespace {

/// Throws std::bad_alloc if `result`, the result of a call of OpenSSL's EVP interface, is not 1.
/// Such a call fails only if memory runs out, because every build of OpenSSL has SHA-256.
void Check(int result) {
  if (result != 1) throw std::bad_alloc();
}

}  // namespace

void Sha256Stream::Deleter::operator()(evp_md_ctx_st* context) const { EVP_MD_CTX_free(context); }

Sha256Stream::Sha256Stream() : context_(EVP_MD_CTX_new()) {
  Check(context_ != nullptr ? EVP_DigestInit_ex(context_.get(), EVP_sha256(), nullptr) : 0);
}

void Sha256Stream::Add(std::string_view bytes) {
  Check(EVP_DigestUpdate(context_.get(), bytes.data(), bytes.size()));
}

std::string Sha256Stream::Digest() const {
  const Sha256Stream copy;
  std::array<unsigned char, 32> digest{};
  Check(EVP_MD_CTX_copy_ex(copy.context_.get(), context_.get()));
  Check(EVP_DigestFinal_ex(copy.context_.get(), digest.data(), nullptr));
  constexpr const char* kHex = "0123456789abcdef";
  std::string text;
  for (const unsigned char byte : digest) (text += kHex[byte >> 4]) += kHex[byte & 15];
  return text;
}

std::string Sha256(std::string_view bytes) {
  Sha256Stream stream;
  stream.Add(bytes);
  return stream.Digest();
}

std::string Sha256OfFile(const std::filesystem::path& file) {
  errno = 0;
  std::ifstream input(file, std::ios::binary);
  if (!input && errno == ENOMEM) throw std::bad_alloc();
  if (!input) return {};
  Sha256Stream stream;
  std::array<char, 1 << 16> buffer;
  while (input.read(buffer.data(), buffer.size()) || input.gcount() > 0) {
    stream.Add({buffer.data(), static_cast<std::size_t>(input.gcount())});
  }
  return input.bad() ? "" : stream.Digest();
}

}  // namespace alidade::internal
