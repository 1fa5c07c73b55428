// SPDX-License-Identifier: Apache-2.0
#include "alidade/config/unit.h"

#include <gtest/gtest.h>

#include <numbers>

namespace alidade::internal {
namespace {

TEST(ParseUnit, DividesTheFirstFactorByTheOthers) {
  EXPECT_EQ(ParseUnit("mm")->factor, 1e-3);
  EXPECT_EQ(ParseUnit("mm")->si, "m");
  EXPECT_DOUBLE_EQ(ParseUnit("deg/s")->factor, std::numbers::pi / 180.0);
  EXPECT_EQ(ParseUnit("deg/s")->si, "rad/s");
  // 1 km/h = 1000 m / 3600 s
  EXPECT_DOUBLE_EQ(ParseUnit("km/h")->factor, 1.0 / 3.6);
  EXPECT_EQ(ParseUnit("m/s^2")->dimensions, ParseUnit("m/s2")->dimensions);
  EXPECT_NE(ParseUnit("m/s")->dimensions, ParseUnit("m")->dimensions);
  for (const char* unknown : {"", "/s", "m/", "x", "m/s^1.5"}) EXPECT_FALSE(ParseUnit(unknown));
}

TEST(SplitUnit, FindsTheUnitAtTheEndOfAKey) {
  EXPECT_EQ(SplitUnit("rate_deg_s").stem, "rate");
  EXPECT_EQ(SplitUnit("rate_deg_s").suffix, "deg_s");
  EXPECT_EQ(SplitUnit("rate_deg_s").unit.dimensions, ParseUnit("rad/s")->dimensions);
  EXPECT_EQ(SplitUnit("depth_min").suffix, "");
  EXPECT_EQ(SplitUnit("m").suffix, "");
}

TEST(ParseQuantity, ReadsANumberWithAUnit) {
  EXPECT_EQ(ParseQuantity("65mm")->value, 65.0);
  EXPECT_EQ(ParseQuantity("-3 deg/s")->value, -3.0);
  for (const char* other : {"65", "mm", "65x", "", "6 5mm", "nanm"})
    EXPECT_FALSE(ParseQuantity(other));
}

TEST(ConvertedText, ConvertsToTheUnit) {
  EXPECT_EQ(ConvertedText(*ParseQuantity("65mm"), *ParseUnit("m")), "0.065");
  EXPECT_EQ(ConvertedText(*ParseQuantity("65mm"), *ParseUnit("cm")), "6.5");
  EXPECT_EQ(ConvertedText(*ParseQuantity("180deg"), *ParseUnit("rad")), "3.14159265");
}

}  // namespace
}  // namespace alidade::internal
