// SPDX-License-Identifier: Apache-2.0
#include "sensors/magnetometer.h"

#include <gtest/gtest.h>

#include "support/sensor_checks.h"

namespace alidade {
namespace {

using namespace testing;

// A body that heads north and lies on its right side, in a world with x east. Its axes point to the
// north, upwards and to the east.
TEST(Magnetometer, MeasuresTheFieldInTheBody) {
  const SharedSensor sensor = MakeSensor(Magnetometer({0.1, 0.2, 0.3}, {2, 20, -43}), "mag");
  const Blocks roles{kCyclicTurn, {1, 0, 0.5}, kNeutral};
  EXPECT_EQ(Prediction(sensor, roles), (std::vector<double>{21, -43, 2.5}));
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

// Strength 50 uT, inclination 60 degrees downwards, declination 90 degrees to the east. M_PI / 2
// differs from 90 degrees by 6e-17, so that the element to the north is 2e-15 uT.
TEST(Magnetometer, HasTheFieldOfStrengthInclinationAndDeclination) {
  const std::array<double, 3> m = Magnetometer::FieldOf(50, M_PI / 3, M_PI / 2);
  ExpectSame({m.begin(), m.end()}, {25, 0, -50 * std::sqrt(0.75)}, 1e-14);
}

}  // namespace
}  // namespace alidade
