// SPDX-License-Identifier: Apache-2.0
#include "alidade/io/wrap_text.h"

#include <gtest/gtest.h>

#include "alidade/io/text_table.h"

namespace alidade::internal {
namespace {

TEST(WrapText, BreaksAtBlanksOnly) {
  EXPECT_EQ(WrapText("one two three\nfour\n", 9), "one two\n  three\nfour\n");
  EXPECT_EQ(WrapText("  one two three", 11), "  one two\n    three");
  EXPECT_EQ(WrapText("abcdefghijkl mn", 5, 0), "abcdefghijkl\nmn");
  EXPECT_EQ(WrapText("short", 80), "short");
}

TEST(WrapText, IndentsToTheLastColumnOfTheFirstHalf) {
  EXPECT_EQ(WrapText("ok  one two three", 12), "ok  one two\n    three");
  EXPECT_EQ(WrapText("ok  one two  three four", 16), "ok  one two\n    three four");
}

TEST(WrapText, CountsCharactersNotBytes) {
  EXPECT_EQ(WrapText("\u00fc\u00fc\u00fc \u00fc\u00fc", 6), "\u00fc\u00fc\u00fc \u00fc\u00fc");
}

TEST(FormatTable, AlignsNumbersAtThePoint) {
  const Table table = MakeTable({"a", "b"}, {{"x", {"2.04", "diverged"}},
                                             {"count", {"1,234", "75/75"}},
                                             {"marked", {"206 !", "-"}},
                                             {"small", {"0.0012", "0.5"}}});
  EXPECT_EQ(FormatTable(table, TableFormat::kText),
            "                 a         b\n"
            "x           2.04    diverged\n"
            "count   1,234        75/75\n"
            "marked    206 !          -\n"
            "small       0.0012       0.5\n");
}

TEST(FormatTable, DividesTheTableAndWrapsHeaders) {
  const Table table = MakeTable({"rmse of depth", "NEES"}, {{"ekf", {"1.5", "0.9"}}}, "estimator");
  EXPECT_EQ(FormatTable(table, TableFormat::kText, 24),
            "                rmse of\n"
            "estimator         depth\n"
            "ekf                 1.5\n"
            "\n"
            "estimator  NEES\n"
            "ekf         0.9\n");
}

TEST(FormatTable, TransposesRowsAndColumns) {
  const Table table = Transposed(MakeTable({"a", "b"}, {{"x", {"1", "2"}}}));
  EXPECT_EQ(FormatTable(table, TableFormat::kText), "   x\na  1\nb  2\n");
}

}  // namespace
}  // namespace alidade::internal
