// SPDX-License-Identifier: Apache-2.0
#include "alidade/base/number_text.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace alidade::internal {
namespace {

TEST(NumberText, IsTheShortestThatReadsBack) {
  EXPECT_EQ(NumberText(0.1), "0.1");
  EXPECT_EQ(NumberText(1e-5), "1e-05");
  EXPECT_EQ(NumberText(-0.0), "-0");
  EXPECT_EQ(NumberText(1.0 / 3.0), "0.3333333333333333");
  EXPECT_EQ(NumberText(-std::nan("")), "nan");
  EXPECT_EQ(NumberText(-std::numeric_limits<double>::infinity()), "-inf");
}

TEST(RoundedText, HasAFewDigits) {
  EXPECT_EQ(RoundedText(0.0234567, 4), "0.02346");
  EXPECT_EQ(RoundedText(21.0, 4), "21");
  EXPECT_EQ(RoundedText(1.5e9, 4), "1.5e+09");
}

TEST(Seconds, AreExactToTheNanosecond) {
  const auto text = [](Timestamp timestamp) {
    std::string seconds;
    AppendSeconds(seconds, timestamp);
    return seconds;
  };
  EXPECT_EQ(text(0), "0.000000000");
  EXPECT_EQ(text(33'000'000), "0.033000000");
  EXPECT_EQ(text(-1), "-0.000000001");
  // A double has only 16 significant digits.
  EXPECT_EQ(text(1'700'000'000'123'456'789), "1700000000.123456789");
  EXPECT_EQ(text(INT64_MAX), "9223372036.854775807");
  EXPECT_EQ(text(INT64_MIN), "-9223372036.854775808");
}

}  // namespace
}  // namespace alidade::internal
