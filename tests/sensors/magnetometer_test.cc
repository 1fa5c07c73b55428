// SPDX-License-Identifier: Apache-2.0
#include "sensors/magnetometer.h"

#include <gtest/gtest.h>

#include "support/sensor_checks.h"

namespace alidade {
namespace {

using namespace testing;

// A body that heads north in a world with x east: its x axis is the y axis of the world.
TEST(Magnetometer, MeasuresTheFieldInTheBody) {
  const SharedSensor sensor = MakeSensor(Magnetometer({0.1, 0.2, 0.3}, {2, 20, -43}), "mag");
  const Blocks roles{kQuarterTurn, {1, 0, 0.5}, kNeutral};
  ExpectSame(Prediction(sensor, roles), {21, -2, -42.5}, 1e-14);
  EXPECT_EQ(NoiseDiagonal(sensor, roles), (std::vector<double>{0.1, 0.2, 0.3}));
}

TEST(Magnetometer, IsInTheFrameOfTheMountedSensor) {
  const Eigen::Vector3d field(2, 20, -43), iron(1, 0, 0.5);
  const SharedSensor sensor = MakeSensor(Magnetometer({0.1, 0.1, 0.1}, {2, 20, -43}), "mag");
  const std::vector<double> mounting{0.1, 0.7, 0.7, -0.1};
  const Blocks roles{kAttitude, Elements(iron), mounting};
  const Eigen::Vector3d z =
      RotationMatrix(mounting).transpose() * RotationMatrix(kAttitude).transpose() * field + iron;
  ExpectSame(Prediction(sensor, roles), Elements(z), 1e-15);
  ExpectTrueJacobian(sensor, roles);
}

// Strength 50 uT, inclination 60 degrees downwards, declination 90 degrees to the east.
TEST(Magnetometer, HasTheFieldOfStrengthInclinationAndDeclination) {
  const std::array<double, 3> m = Magnetometer::FieldOf(50, M_PI / 3, M_PI / 2);
  ExpectSame({m.begin(), m.end()}, {25, 0, -50 * std::sqrt(0.75)}, 1e-14);
}

}  // namespace
}  // namespace alidade
