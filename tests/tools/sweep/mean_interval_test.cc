// SPDX-License-Identifier: Apache-2.0
#include "alidade/sweep/mean_interval.h"

#include <gtest/gtest.h>

#include <cmath>

namespace alidade::internal {
namespace {

// n values of -1 and 1 in equal numbers have the mean 0 and s^2 = n / (n - 1). The half width of
// the interval is then t / sqrt(n - 1). t is from tables of Student's distribution.
TEST(MeanInterval, HasTheWidthOfStudentsDistribution) {
  for (const auto& [n, t] : std::vector<std::pair<int, double>>{
           {2, 12.706}, {4, 3.182}, {6, 2.571}, {20, 2.093}, {200, 1.972}}) {
    std::vector<double> values;
    for (int i = 0; i < n; ++i) values.push_back(i % 2 == 0 ? -1.0 : 1.0);
    const Interval interval = MeanInterval(values);
    const double half = t / std::sqrt(n - 1.0);
    EXPECT_NEAR(interval.high, half, 0.01 * half) << n;
    EXPECT_NEAR(interval.low, -half, 0.01 * half) << n;
  }
}

TEST(MeanInterval, NeedsTwoValues) {
  EXPECT_TRUE(std::isnan(MeanInterval({}).low));
  EXPECT_TRUE(std::isnan(MeanInterval({3.0}).high));
}

}  // namespace
}  // namespace alidade::internal
