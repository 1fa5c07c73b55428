// SPDX-License-Identifier: Apache-2.0
#include "alidade/compare/distance.h"

#include <gtest/gtest.h>

#include <cmath>

namespace alidade {
namespace {

/// Returns a series of a scalar block and a quaternion block. Only variances are stored.
internal::Series TwoBlocks() {
  internal::Series series;
  series.blocks = {{"a.x", "m", Geometry::Vector(1)}, {"a.q", "", Geometry::UnitQuaternion()}};
  series.joint = false;
  return series;
}

// q and -q are the same rotation. Distances are computed in the tangent space of the reference.
TEST(Series, DistancesAreOfTheTangentAndOfSharedTimestamps) {
  internal::Series series = TwoBlocks(), reference = TwoBlocks();
  series.timestamps = {10, 20, 30};
  series.values = {9, 1, 0, 0, 0, 1.5, -1, 0, 0, 0, 2.0, std::cos(0.1), std::sin(0.1), 0, 0};
  series.covariances.assign(12, 1.0);
  reference.timestamps = {20, 30, 40};
  reference.values = {1, 1, 0, 0, 0, 1, 1, 0, 0, 0, 1, 1, 0, 0, 0};
  reference.covariances.assign(12, 0.25);
  const internal::Distance distance = internal::DistanceBetween(series, reference);
  EXPECT_NEAR(distance.rms.at("a.x"), std::sqrt((0.25 + 1.0) / 2.0), 1e-15);
  EXPECT_NEAR(distance.final.at("a.x"), 1.0, 1e-15);
  EXPECT_NEAR(distance.final.at("a.q"), 0.2, 1e-12);
  // The sum (0.5^2 + 1^2 + 0.2^2) / 0.25 is divided by two timestamps times four degrees of
  // freedom.
  EXPECT_NEAR(distance.sigmas.at("a"), std::sqrt((0.25 + 1.0 + 0.04) / 0.25 / 8.0), 1e-12);
}

TEST(Series, WhatHasNoValueOrVarianceIsLeftOut) {
  const double nan = std::nan("");
  internal::Series series = TwoBlocks(), reference = TwoBlocks();
  series.timestamps = reference.timestamps = {10, 20};
  series.values = {nan, 1, 0, 0, 0, 3, 1, 0, 0, 0};
  reference.values = {1, 1, 0, 0, 0, 1, 1, 0, 0, 0};
  series.covariances = reference.covariances = {1, 1, 1, 1, 0, 1, 1, 1};
  const internal::Distance distance = internal::DistanceBetween(series, reference);
  EXPECT_EQ(distance.rms.at("a.x"), 2.0);
  // One value is NaN. The other value is known exactly.
  EXPECT_FALSE(distance.sigmas.contains("a"));
}

// A block that is fixed in both series is not compared. A block that is fixed only in the reference
// has no rows in the P of the reference.
TEST(Series, FixedBlocksTakeNothingFromTheOthers) {
  const double nan = std::nan("");
  internal::Series series = TwoBlocks(), reference = TwoBlocks();
  series.timestamps = reference.timestamps = {10};
  series.values = {3, 1, 0, 0, 0};
  reference.values = {1, 1, 0, 0, 0};
  series.covariances = {1, 1, 1, 1};
  reference.covariances = {4, nan, nan, nan};
  reference.blocks[1].constant = true;
  internal::Distance distance = internal::DistanceBetween(series, reference);
  EXPECT_NEAR(distance.sigmas.at("a"), 1.0, 1e-15);
  EXPECT_TRUE(distance.rms.contains("a.q"));
  series.blocks[1].constant = true;
  distance = internal::DistanceBetween(series, reference);
  EXPECT_NEAR(distance.sigmas.at("a"), 1.0, 1e-15);
  EXPECT_FALSE(distance.rms.contains("a.q"));
}

}  // namespace
}  // namespace alidade
