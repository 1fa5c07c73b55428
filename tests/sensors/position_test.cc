// SPDX-License-Identifier: Apache-2.0
#include "sensors/position.h"

#include <gtest/gtest.h>

#include "support/sensor_checks.h"

namespace alidade {
namespace {

using namespace testing;

// The body is at (10, 20) m and heads along y. The antenna is 2 m ahead of it and 1 m to its left,
// so at (10 - 1, 20 + 2) m.
TEST(Position, AddsTheLeverArmInThePlane) {
  const SharedSensor sensor = MakeSensor(Position<2>({0.1, 0.2}), "position");
  const Blocks roles{{10, 20}, {M_PI / 2}, {2, 1}};
  ExpectSame(Prediction(sensor, roles), {9, 22}, 1e-15);
  EXPECT_EQ(NoiseDiagonal(sensor, roles), (std::vector<double>{0.1, 0.2}));
  ExpectSame(Initialised(sensor, roles, {9, 22}), {10, 20}, 1e-15);
  ExpectTrueJacobian(sensor, {{10, 20}, {0.3}, {2, 1}});
}

TEST(Position, AddsTheLeverArmInSpace) {
  const SharedSensor sensor = MakeSensor(Position<3>({0.1, 0.2, 0.3}), "position");
  const Blocks roles{{1, 2, 3}, kAttitude, {0.5, -0.2, 1.5}};
  const Eigen::Vector3d z =
      Eigen::Vector3d(1, 2, 3) + RotationMatrix(kAttitude) * Eigen::Vector3d(0.5, -0.2, 1.5);
  ExpectSame(Prediction(sensor, roles), Elements(z), 1e-15);
  ExpectSame(Initialised(sensor, roles, Elements(z)), {1, 2, 3}, 1e-15);
  ExpectTrueJacobian(sensor, roles);
}

TEST(Position, IsAlignedWithTheWorldWithoutAttitude) {
  const SharedSensor planar = MakeSensor(Position<2>({0.1, 0.2}), "position");
  EXPECT_EQ(Prediction(planar, {{10, 20}, {}, {2, 1}}), (std::vector<double>{12, 21}));
  const SharedSensor spatial = MakeSensor(Position<3>({0.1, 0.2, 0.3}), "position");
  EXPECT_EQ(Prediction(spatial, {{1, 2, 3}, {}, {1, 0, 2}}), (std::vector<double>{2, 2, 5}));
  EXPECT_TRUE(spatial->roles()[1].optional());
}

}  // namespace
}  // namespace alidade
