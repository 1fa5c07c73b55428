// SPDX-License-Identifier: Apache-2.0
#include "alidade/base/timestamp.h"

#include <gtest/gtest.h>

#include <limits>

#include "alidade/base/error.h"

namespace alidade {
namespace {

TEST(TimestampFromSeconds, IsTheNearestNanosecond) {
  EXPECT_EQ(TimestampFromSeconds(0.0), 0);
  EXPECT_EQ(TimestampFromSeconds(0.033), 33'000'000);
  EXPECT_EQ(TimestampFromSeconds(1.4e-9), 1);
  EXPECT_EQ(TimestampFromSeconds(1.6e-9), 2);
  EXPECT_EQ(TimestampFromSeconds(-1.6e-9), -2);
  EXPECT_EQ(TimestampFromSeconds(-0.25), -250'000'000);
}

TEST(TimestampFromSeconds, KeepsEveryBitOfLongTimes) {
  // 2^30 + 2^-22 s is exact as a double, but 1e9 times this number is not. 2^-22 s = 238.4 ns.
  EXPECT_EQ(TimestampFromSeconds(0x1p30 + 0x1p-22), 1'073'741'824'000'000'238);
}

TEST(TimestampFromSeconds, SteppingByCountDoesNotDrift) {
  for (int k = 0; k < 100000; ++k) {
    ASSERT_EQ(TimestampFromSeconds(k * 0.033), k * Timestamp{33'000'000});
  }
}

TEST(TimestampFromSeconds, RefusesWhatNoTimestampHolds) {
  EXPECT_THROW(TimestampFromSeconds(9.3e9), ContractViolation);
  EXPECT_THROW(TimestampFromSeconds(-9.3e9), ContractViolation);
  EXPECT_THROW(TimestampFromSeconds(std::numeric_limits<double>::quiet_NaN()), ContractViolation);
}

TEST(Seconds, UndoesTimestampFromSeconds) {
  for (const double t_s : {0.0, 0.033, 4.983, -2.5, 1e6 + 0.125}) {
    EXPECT_NEAR(Seconds(TimestampFromSeconds(t_s)), t_s, 0.5e-9 + 1e-15 * t_s) << t_s;
  }
}

}  // namespace
}  // namespace alidade
