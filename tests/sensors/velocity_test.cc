// SPDX-License-Identifier: Apache-2.0
#include "sensors/velocity.h"

#include <gtest/gtest.h>

#include "support/sensor_checks.h"

namespace alidade {
namespace {

using namespace testing;

// The body heads along y and turns left at 0.5 rad/s. The antenna is 2 m ahead of it, so it moves
// to the left of the body, along -x, at 1 m/s.
TEST(Velocity, IncludesTheTurnOfTheBodyInThePlane) {
  const SharedSensor sensor = MakeSensor(Velocity<2>({0.1, 0.2}), "velocity");
  const Blocks roles{{3, 4}, {M_PI / 2}, {0.5}, {2, 0}};
  ExpectSame(Prediction(sensor, roles), {2, 4}, 1e-15);
  EXPECT_EQ(NoiseDiagonal(sensor, roles), (std::vector<double>{0.1, 0.2}));
  ExpectSame(Initialised(sensor, roles, {2, 4}), {3, 4}, 1e-15);
  ExpectTrueJacobian(sensor, {{3, 4}, {0.3}, {0.5}, {2, 1}});
}

TEST(Velocity, IncludesTheTurnOfTheBodyInSpace) {
  const SharedSensor sensor = MakeSensor(Velocity<3>({0.1, 0.2, 0.3}), "velocity");
  const Eigen::Vector3d v(1, -2, 3), omega(0.1, 0.4, -0.3), arm(0.5, -0.2, 1.5);
  const Blocks roles{Elements(v), kAttitude, Elements(omega), Elements(arm)};
  const Eigen::Vector3d z = v + RotationMatrix(kAttitude) * omega.cross(arm);
  ExpectSame(Prediction(sensor, roles), Elements(z), 1e-15);
  ExpectSame(Initialised(sensor, roles, Elements(z)), Elements(v), 1e-15);
  ExpectTrueJacobian(sensor, roles);
}

TEST(Velocity, NeedsNeitherAttitudeNorTurnRate) {
  const SharedSensor sensor = MakeSensor(Velocity<3>({0.1, 0.2, 0.3}), "velocity");
  EXPECT_EQ(Prediction(sensor, {{1, -2, 3}, {}, {}, {1, 2, 3}}), (std::vector<double>{1, -2, 3}));
}

}  // namespace
}  // namespace alidade
