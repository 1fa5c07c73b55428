// SPDX-License-Identifier: Apache-2.0
#include "sensors/turn_rate.h"

#include <gtest/gtest.h>

#include "support/sensor_checks.h"

namespace alidade {
namespace {

using namespace testing;

// 1.02 * 0.5 rad/s + 0.03 rad/s
TEST(TurnRate, HasScaleErrorAndBias) {
  const SharedSensor sensor = MakeSensor(TurnRate<2>(0.01), "turn_rate");
  const Blocks roles{{0.5}, {0.03}, {0.02}};
  ExpectSame(Prediction(sensor, roles), {0.54}, 1e-15);
  EXPECT_EQ(NoiseDiagonal(sensor, roles), std::vector<double>{0.01});
  ExpectSame(Initialised(sensor, roles, {0.54}), {0.5}, 1e-15);
  ExpectTrueJacobian(sensor, roles);
}

TEST(TurnRate, IsInTheFrameOfTheMountedSensor) {
  const SharedSensor sensor = MakeSensor(TurnRate<3>({0.01, 0.02, 0.03}), "turn_rate");
  const Eigen::Vector3d omega(0.1, 0.4, -0.3), bias(0.01, 0.02, -0.05), scale(0.1, 0.2, -0.1);
  const Blocks roles{Elements(omega), Elements(bias), Elements(scale), kAttitude};
  const Eigen::Vector3d in_sensor = RotationMatrix(kAttitude).transpose() * omega;
  const Eigen::Vector3d z = in_sensor + scale.cwiseProduct(in_sensor) + bias;
  ExpectSame(Prediction(sensor, roles), Elements(z), 1e-15);
  EXPECT_EQ(NoiseDiagonal(sensor, roles), (std::vector<double>{0.01, 0.02, 0.03}));
  ExpectSame(Initialised(sensor, roles, Elements(z)), Elements(omega), 1e-14);
  ExpectTrueJacobian(sensor, roles);
}

TEST(TurnRate, HasNoInverseAtAScaleOfZero) {
  const SharedSensor sensor = MakeSensor(TurnRate<2>(0.01), "turn_rate");
  const Blocks roles{{0.5}, {0.03}, {-1.0}};
  const double z = 0.1;
  double y = kPoison;
  EXPECT_EQ(sensor->Initialise(Pointers(roles).data(), {&z}, nullptr, {.y = &y}),
            Status::kOutOfDomain);
  EXPECT_EQ(y, kPoison);
}

}  // namespace
}  // namespace alidade
