// SPDX-License-Identifier: Apache-2.0
#include "alidade/io/utf8.h"

#include <gtest/gtest.h>

namespace alidade::internal {
namespace {

TEST(PrintableUtf8, ReplacesWhatIsNoTextOfUtf8) {
  EXPECT_EQ(PrintableUtf8("", ""), "");
  EXPECT_EQ(PrintableUtf8("a \xC3\xA9 \xF0\x9F\x98\x80", ""), "a \xC3\xA9 \xF0\x9F\x98\x80");
  EXPECT_EQ(PrintableUtf8("a\xFF\x9B[\xC3[\xE2\x82", ""), "a??[?[??");
}

TEST(PrintableUtf8, ReplacesControlCharactersButThoseThatAreKept) {
  EXPECT_EQ(PrintableUtf8("\x1B[1m\t\n\x7F", ""), "?[1m???");
  EXPECT_EQ(PrintableUtf8("\x1B[1m\t\n\x7F", "\n\t"), "?[1m\t\n?");
  EXPECT_EQ(PrintableUtf8("\xC2\x9B\xC2\xA0", "\n"), "?\xC2\xA0");  // U+009B becomes ?
  EXPECT_EQ(PrintableUtf8(std::string_view("\0", 1), "\n"), "?");
}

}  // namespace
}  // namespace alidade::internal
