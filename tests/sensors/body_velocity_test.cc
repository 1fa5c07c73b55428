// SPDX-License-Identifier: Apache-2.0
#include "sensors/body_velocity.h"

#include <gtest/gtest.h>

#include "support/sensor_checks.h"

namespace alidade {
namespace {

using namespace testing;

// The robot heads along y. Its velocity (-1, 3) m/s in the world is 3 m/s forward and 1 m/s to the
// left. It turns left at 0.5 rad/s. A wheel 2 m to its left rolls 0.5 * 2 m/s slower.
TEST(BodyVelocity, IsForwardAndLeftInThePlane) {
  const Blocks roles{{-1, 3}, {M_PI / 2}, {0.5}, {0, 2}, {0}};
  const SharedSensor both = MakeSensor(BodyVelocity<2, 2>({0, 1}, {0.1, 0.2}), "body_velocity");
  ExpectSame(Prediction(both, roles), {2, 1}, 1e-15);
  EXPECT_EQ(NoiseDiagonal(both, roles), (std::vector<double>{0.1, 0.2}));
  ExpectTrueJacobian(both, {{-1, 3}, {0.4}, {0.5}, {1, 2}, {0.1}});
  const SharedSensor left = MakeSensor(BodyVelocity<2, 1>({1}, {0.1}), "body_velocity");
  ExpectSame(Prediction(left, roles), {1}, 1e-15);
  ExpectSame(Prediction(left, {{-1, 3}, {M_PI / 2}, {}, {0, 2}, {0}}), {1}, 1e-15);
}

// A sensor that is mounted at 90 degrees measures the velocity to the left as its x axis.
TEST(BodyVelocity, IsInTheFrameOfTheMountedSensor) {
  const SharedSensor sensor = MakeSensor(BodyVelocity<2, 2>({0, 1}, {0.1, 0.2}), "body_velocity");
  ExpectSame(Prediction(sensor, {{-1, 3}, {M_PI / 2}, {}, {0, 0}, {M_PI / 2}}), {1, -3}, 1e-15);
}

TEST(BodyVelocity, IsInTheFrameOfTheSensorInSpace) {
  const SharedSensor sensor =
      MakeSensor(BodyVelocity<3, 3>({0, 1, 2}, {0.1, 0.2, 0.3}), "body_velocity");
  const std::vector<double> mounting{0.1, 0.7, 0.7, -0.1};
  const Eigen::Vector3d v(1, -2, 3), omega(0.1, 0.4, -0.3), arm(0.5, -0.2, 1.5);
  const Blocks roles{Elements(v), kAttitude, Elements(omega), Elements(arm), mounting};
  const Eigen::Vector3d z = RotationMatrix(mounting).transpose() *
                            (RotationMatrix(kAttitude).transpose() * v + omega.cross(arm));
  ExpectSame(Prediction(sensor, roles), Elements(z), 1e-15);
  ExpectTrueJacobian(sensor, roles);
  const SharedSensor some = MakeSensor(BodyVelocity<3, 2>({0, 2}, {0.1, 0.2}), "body_velocity");
  ExpectSame(Prediction(some, roles), {z[0], z[2]}, 1e-15);
}

}  // namespace
}  // namespace alidade
