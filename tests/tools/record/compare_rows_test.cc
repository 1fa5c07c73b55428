// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/compare_rows.h"

#include <gtest/gtest.h>

#include <sstream>

namespace alidade::internal {
namespace {

RowComparison Compare(const std::string& before, const std::string& now,
                      LastRow last_row = LastRow::kCounts) {
  std::istringstream was(before), is(now);
  return CompareRows(was, is, last_row);
}

TEST(CompareRows, FindsTheFirstCellThatDiffers) {
  const auto one = Compare("t,x\n0,1.25,3\n1,2,3\n", "t,x\n0,1.5,3\n1,9,3\n").difference;
  ASSERT_TRUE(one);
  EXPECT_EQ(one->line, 2);
  EXPECT_EQ(one->column, 5);
  EXPECT_EQ(one->Text(), "now '1.5', was '1.25'");
  const auto first = Compare("a,b\n", "x,b\n").difference;
  ASSERT_TRUE(first);
  EXPECT_EQ(first->column, 1);
  EXPECT_EQ(first->Text(), "now 'x', was 'a'");
}

TEST(CompareRows, KnowsAnEmptyCellAndWhatIsNoText) {
  const auto empty = Compare("1,,3\n", "1,2,3\n").difference;
  ASSERT_TRUE(empty);
  EXPECT_EQ(empty->Text(), "now '2', was ''");
  const auto bytes = Compare("\x01\x02\n", "\x01\x03\n").difference;
  ASSERT_TRUE(bytes);
  EXPECT_EQ(bytes->Text(), "other bytes");
}

TEST(CompareRows, SaysWhichGoesOn) {
  const RowComparison longer = Compare("1\n2\n", "1\n");
  EXPECT_FALSE(longer.difference);
  EXPECT_TRUE(longer.before_goes_on);
  EXPECT_FALSE(longer.now_goes_on);
  EXPECT_EQ(longer.rows, 1);
  const RowComparison shorter = Compare("", "1\n");
  EXPECT_TRUE(shorter.now_goes_on);
  EXPECT_FALSE(shorter.before_goes_on);
  const RowComparison same = Compare("1\n2", "1\n2");
  EXPECT_FALSE(same.difference || same.before_goes_on || same.now_goes_on);
}

TEST(CompareRows, ARowWithoutItsLineEndCountsOrWasCut) {
  EXPECT_TRUE(Compare("1\n2", "1\n2\n").difference);
  EXPECT_TRUE(Compare("1\n2", "1\n23\n").difference);
  const RowComparison cut = Compare("1\n2", "1\n23\n", LastRow::kWhereWhole);
  EXPECT_FALSE(cut.difference);
  EXPECT_FALSE(cut.before_goes_on);
  EXPECT_TRUE(cut.now_goes_on);
  EXPECT_FALSE(Compare("1\n2", "1\n", LastRow::kWhereWhole).before_goes_on);
}

}  // namespace
}  // namespace alidade::internal
