// SPDX-License-Identifier: Apache-2.0
//
// Effect of the error on an EKF whose initial heading is almost unknown [Barrau2017]. The figures
// are those of docs/estimators.md.
#include <gtest/gtest.h>

#include <cstddef>
#include <vector>

#include "support/inertial_runs.h"

namespace alidade::testing {
namespace {

constexpr int kSeeds = 100;
const std::vector<double> kTimes{3.0, 10.0, 20.0};

// The mean of NEES / 9 over 100 seeds has a standard deviation of sqrt(2 / 9 / 100) = 0.05.
TEST(InvariantErrorRuns, TheLeftErrorSuitsPositionsInTheWorld) {
  const auto plain = MeanErrors(InertialSensor::kGnss, std::nullopt, kTimes, kSeeds);
  const auto left = MeanErrors(InertialSensor::kGnss, ErrorSide::kLeft, kTimes, kSeeds);
  for (std::size_t k = 0; k < kTimes.size(); ++k) EXPECT_NEAR(left[k].nees, 1.0, 0.2) << k;
  EXPECT_GT(plain[0].nees, 4.0 * left[0].nees);
  EXPECT_GT(plain[1].nees, 1.5 * left[1].nees);
}

TEST(InvariantErrorRuns, TheRightErrorSuitsKnownPointsInTheFrameOfTheBody) {
  const auto plain = MeanErrors(InertialSensor::kPoints, std::nullopt, kTimes, kSeeds);
  const auto right = MeanErrors(InertialSensor::kPoints, ErrorSide::kRight, kTimes, kSeeds);
  for (std::size_t k = 0; k < kTimes.size(); ++k)
    EXPECT_GT(plain[k].nees, 4.0 * right[k].nees) << k;
  // The initial error is so large that NEES decreases towards 1 only with time.
  for (std::size_t k = 0; k < kTimes.size(); ++k) EXPECT_GT(right[k].nees, 0.8) << k;
  EXPECT_LT(right[2].nees, 1.5);
}

}  // namespace
}  // namespace alidade::testing
