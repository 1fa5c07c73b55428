// SPDX-License-Identifier: Apache-2.0
#include "alidade/compare/section.h"

#include <gtest/gtest.h>

namespace alidade::internal {
namespace {

TEST(SectionsText, NamesAreQuotedWhereTheFormAsksForIt) {
  const Section section{"A & b", {"x|y", "z"}, {{"r_1|\\", {"1", "2 %"}}}, {}};
  EXPECT_EQ(SectionsText({section}, TableStyle::kMarkdown),
            "**A & b**\n\n|  | x\\|y | z |\n|---|---:|---:|\n| r_1\\|\\\\ | 1 | 2 % |\n");
  EXPECT_EQ(SectionsText({section}, TableStyle::kLatex),
            "\\paragraph{A \\& b}\n\n\\begin{tabular}{lrr}\n\\hline\n & x|y & z \\\\\n"
            "\\hline\nr\\_1|\\textbackslash{} & 1 & 2 \\% \\\\\n\\hline\n\\end{tabular}\n");
}

}  // namespace
}  // namespace alidade::internal
