// SPDX-License-Identifier: Apache-2.0
#include "alidade/replay/compare_rows.h"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "alidade/base/error.h"
#include "support/temporary_folder.h"

namespace alidade::internal {
namespace {

RowComparison Compare(const std::string& before, const std::string& now) {
  std::istringstream was(before), is(now);
  return CompareRows(was, is);
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
  EXPECT_EQ(bytes->Text(), "the bytes differ");
}

TEST(CompareRows, SaysWhichGoesOn) {
  const RowComparison longer = Compare("1\n2\n", "1\n");
  EXPECT_FALSE(longer.difference);
  EXPECT_TRUE(longer.recorded_has_more);
  EXPECT_FALSE(longer.current_has_more);
  EXPECT_EQ(longer.rows, 1);
  const RowComparison shorter = Compare("", "1\n");
  EXPECT_TRUE(shorter.current_has_more);
  EXPECT_FALSE(shorter.recorded_has_more);
  const RowComparison same = Compare("1\n2", "1\n2");
  EXPECT_FALSE(same.difference || same.recorded_has_more || same.current_has_more);
}

TEST(CompareRows, ARowWithoutItsLineEndCounts) {
  const auto end = Compare("1\n2", "1\n2\n").difference;
  ASSERT_TRUE(end);
  EXPECT_EQ(end->Text(), "the line end differs");
  EXPECT_EQ(Compare("1,\n", "1,").difference->Text(), "the line end differs");
  EXPECT_EQ(Compare("12\n", "1").difference->Text(), "now '1', was '12'");
  EXPECT_TRUE(Compare("1\n2", "1\n23\n").difference);
}

TEST(CompareRows, AFileThatIsNotThereHasNoRowsAndOneThatCannotBeReadIsAnError) {
  const testing::TemporaryFolder folder;
  const std::filesystem::path file = folder / "a.csv";
  std::ofstream(file) << "1\n";
  const RowComparison missing = CompareRows(file, folder / "b.csv");
  EXPECT_TRUE(missing.recorded_has_more);
  EXPECT_FALSE(missing.difference);
  try {
    CompareRows(folder.path(), file);
    ADD_FAILURE() << "no error; expected an error, because a folder has no rows";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ExitCode::kIo);
    EXPECT_TRUE(std::string(error.what()).starts_with(folder.path().string())) << error.what();
  }
}

}  // namespace
}  // namespace alidade::internal
