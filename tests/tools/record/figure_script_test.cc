// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/figure_script.h"

#include <gtest/gtest.h>

namespace alidade::internal {
namespace {

std::string ScriptOver(double first_s, double last_s) {
  FigureScript script("state", "ekf", TimestampFromSeconds(first_s), TimestampFromSeconds(last_s));
  script.Panel("depth", "[m]");
  script.LineOf({"a.csv", 100, 1}, "1", "column('d')", 1, "d");
  return script.Text();
}

TEST(FigureScript, CountsFromTheFirstSecondWhereTimestampsAreFarFromZero) {
  const std::string script = ScriptOver(1.7e9 + 0.25, 1.7e9 + 10.0);
  EXPECT_NE(script.find("t0 = 1700000000.0\n"), std::string::npos) << script;
  EXPECT_NE(script.find("set xrange [0.250000000:10.000000000]"), std::string::npos) << script;
}

TEST(FigureScript, TakesTheWholeRangeOfTimestamps) {
  // The timestamps span 1.82e10 s, which a Timestamp cannot represent. A line bridges gaps of up to
  // 4 % of this span.
  const std::string script = ScriptOver(-9.1e9, 9.1e9);
  EXPECT_NE(script.find("t0 = 0.0\n"), std::string::npos) << script;
  EXPECT_NE(script.find("set xrange [-9100000000.000000000:9100000000.000000000]"),
            std::string::npos)
      << script;
  EXPECT_NE(script.find("gap = 7.28e+08,"), std::string::npos) << script;
}

TEST(FigurePages, LeaveOutNoPanelAndAreOfOneSize) {
  const auto panel = [](FigureScript& script, std::size_t i) {
    script.Panel("panel " + std::to_string(i), "");
  };
  const auto pages = [&](std::size_t panels) {
    return FigurePages({"ekf.state", "ekf: state", 0, 1}, panels, panel);
  };
  EXPECT_TRUE(pages(0).empty());
  ASSERT_EQ(pages(12).size(), 1u);
  EXPECT_EQ(pages(12)[0].title(), "ekf: state");
  const std::vector<FigureScript> three = pages(25);  // pages with 8, 8 and 9 panels
  ASSERT_EQ(three.size(), 3u);
  EXPECT_EQ(three[0].name(), "ekf.state");
  EXPECT_EQ(three[1].name(), "ekf.state.2");
  EXPECT_EQ(three[2].title(), "ekf: state (3 of 3)");
  for (int i = 0; i < 25; ++i) {
    const std::string label = "set label 1 'panel " + std::to_string(i) + "'";
    EXPECT_NE(three[i < 8 ? 0 : i < 16 ? 1 : 2].Text().find(label), std::string::npos) << i;
  }
}

}  // namespace
}  // namespace alidade::internal
