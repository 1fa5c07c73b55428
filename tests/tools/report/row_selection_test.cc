// SPDX-License-Identifier: Apache-2.0
#include "alidade/report/row_selection.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>

#include "alidade/report/csv_columns.h"
#include "support/temporary_folder.h"

namespace alidade::internal {
namespace {

using Rows = std::vector<std::uint32_t>;

class RowSelectionTest : public ::testing::Test {
 protected:
  std::filesystem::path Write(const std::string& text) const {
    std::ofstream(folder_ / "table.csv") << text;
    return folder_ / "table.csv";
  }
  const alidade::testing::TemporaryFolder folder_;
};

TEST_F(RowSelectionTest, KeepsTheMostImportantRowOfEachSequence) {
  const auto file = Write("t_s,nees:a,nees:b\n0,1,1\n1,2,1\n2,1,9\n3,1,1\n4,1,1\n");
  EXPECT_EQ(SelectRows(file, {}, "nees:", 5).rows, std::nullopt);
  EXPECT_EQ(SelectRows(file, {}, "nees:", 2).rows, (Rows{2, 3}));
  EXPECT_EQ(SelectRows(file, {}, "", 2).rows, (Rows{0, 3}));
}

TEST_F(RowSelectionTest, KeepsRareRowsBesideFrequentOnes) {
  std::string text = "t_s,sensor,outcome,nis\n";
  for (int k = 0; k < 100; ++k) {
    text += std::to_string(k) + (k % 40 == 7 ? ",a,gated,50\n" : ",a,accepted,1\n");
    if (k % 50 == 0) text += std::to_string(k) + ",b,accepted,\n";
  }
  const CsvColumns kept(Write(text), SelectRows(Write(text), {"sensor", "outcome"}, "nis", 10));
  const auto outcomes = kept.Texts("outcome"), sensors = kept.Texts("sensor");
  EXPECT_EQ(std::ranges::count(outcomes, "gated"), 3);
  EXPECT_EQ(std::ranges::count(sensors, "b"), 2);
  EXPECT_EQ(kept.rows(), 15u);
}

TEST_F(RowSelectionTest, ReadsOnlyTheSelectedRows) {
  const auto file = Write("t_s,text,value\n0,\"a \"\"b\"\", c\",1\n1,\"two\nlines\",2\n2,x,3\n3,y");
  const CsvColumns all(file), some(file, {.rows = Rows{1, 2}});
  EXPECT_EQ(all.rows(), 3u);
  EXPECT_EQ(all.Texts("text")[0], "a \"b\", c");
  EXPECT_EQ(some.rows(), 2u);
  EXPECT_EQ(some.Texts("text"), (std::vector<std::string_view>{"two\nlines", "x"}));
  EXPECT_EQ(some.Numbers("value"), (std::vector<double>{2.0, 3.0}));
}

TEST_F(RowSelectionTest, SelectsTimesOfALongTable) {
  std::string text = "t_s,depth\n";
  for (std::size_t k = 0; k <= kMaxRows; ++k) text += std::to_string(k) + ",1\n";
  const std::vector<Timestamp> times = {TimestampFromSeconds(3.0), TimestampFromSeconds(7.0)};
  EXPECT_EQ(SelectTimes(Write(text), times).rows, (Rows{3, 7}));
  EXPECT_EQ(SelectTimes(Write("t_s,depth\n0,1\n3,1\n"), times).rows, std::nullopt);
}

}  // namespace
}  // namespace alidade::internal
