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
  // The span, 1.82e10 s, does not fit a timestamp. A line bridges four of its hundredths.
  const std::string script = ScriptOver(-9.1e9, 9.1e9);
  EXPECT_NE(script.find("t0 = 0.0\n"), std::string::npos) << script;
  EXPECT_NE(script.find("set xrange [-9100000000.000000000:9100000000.000000000]"),
            std::string::npos)
      << script;
  EXPECT_NE(script.find("gap = 7.28e+08,"), std::string::npos) << script;
}

}  // namespace
}  // namespace alidade::internal
