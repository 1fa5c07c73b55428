// SPDX-License-Identifier: Apache-2.0
#include "sensors/specific_force.h"

#include <gtest/gtest.h>

#include "support/sensor_checks.h"

namespace alidade {
namespace {

using namespace testing;

// A body that lies on its right side: its y axis points upwards.
TEST(SpecificForce, PointsUpwardsAtRest) {
  const SharedSensor sensor = MakeSensor(SpecificForce({0.1, 0.2, 0.3}), "specific_force");
  const Blocks roles{kCyclicTurn, {0.5, 0, -0.25}, kNeutral};
  EXPECT_EQ(Prediction(sensor, roles), (std::vector<double>{0.5, 9.80665, -0.25}));
  EXPECT_EQ(NoiseDiagonal(sensor, roles), (std::vector<double>{0.1, 0.2, 0.3}));
}

TEST(SpecificForce, IsInTheFrameOfTheMountedSensor) {
  const Eigen::Vector3d g(0.5, -1, -9.7), bias(0.1, 0.2, -0.3);
  const SharedSensor sensor =
      MakeSensor(SpecificForce({0.1, 0.1, 0.1}, {g[0], g[1], g[2]}), "specific_force");
  const std::vector<double> mounting{0.1, 0.7, 0.7, -0.1};
  const Blocks roles{kAttitude, Elements(bias), mounting};
  const Eigen::Vector3d z =
      -RotationMatrix(mounting).transpose() * RotationMatrix(kAttitude).transpose() * g + bias;
  ExpectSame(Prediction(sensor, roles), Elements(z), 1e-15);
  ExpectTrueJacobian(sensor, roles);
}

TEST(SpecificForce, IsInvalidIfTheBodyAccelerates) {
  const SharedSensor sensor =
      MakeSensor(SpecificForce({0.1, 0.1, 0.1}, {0, 0, -10}, 0.5), "specific_force");
  const auto valid = [&](double x, double y, double z) {
    const double values[3] = {x, y, z};
    return sensor->Valid({values}) == Status::kOk;
  };
  EXPECT_TRUE(valid(6, 0, 8));
  EXPECT_TRUE(valid(0, 10.5, 0));
  EXPECT_FALSE(valid(0, 10.6, 0));
  EXPECT_FALSE(valid(0, 0, 9.4));
}

}  // namespace
}  // namespace alidade
