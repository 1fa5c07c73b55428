// SPDX-License-Identifier: Apache-2.0
#include "alidade/io/sha256.h"

#include <gtest/gtest.h>

#include <string>

namespace alidade {
namespace {

// The expected values are NIST's examples for FIPS 180-4: a message of one block, a message of two
// blocks, and an empty message.
TEST(Sha256, AgreesWithTheStandard) {
  EXPECT_EQ(internal::Sha256("abc"),
            "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(internal::Sha256("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  EXPECT_EQ(internal::Sha256(""),
            "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(internal::Sha256(std::string(1'000'000, 'a')),
            "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST(Sha256, DoesNotDependOnThePieces) {
  const std::string text(1000, 'b');
  for (const std::size_t size : {1u, 63u, 64u, 65u, 200u, 1000u}) {
    internal::Sha256Stream stream;
    for (std::size_t at = 0; at < text.size(); at += size) {
      stream.Add(std::string_view(text).substr(at, size));
      EXPECT_EQ(stream.Digest(), internal::Sha256(text.substr(0, at + size))) << size;
    }
  }
}

}  // namespace
}  // namespace alidade
