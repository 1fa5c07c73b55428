// SPDX-License-Identifier: Apache-2.0
#include "sensors/altitude.h"

#include <gtest/gtest.h>

#include "support/sensor_checks.h"

namespace alidade {
namespace {

using namespace testing;

TEST(Altitude, IsTheHeightPlusBias) {
  const SharedSensor height = MakeSensor(Altitude<1, false>(0.5), "altitude");
  EXPECT_EQ(Prediction(height, {{120}, {-2}}), std::vector<double>{118});
  EXPECT_EQ(NoiseDiagonal(height, {{120}, {-2}}), std::vector<double>{0.5});
  const SharedSensor position = MakeSensor(Altitude<3, false>(0.5), "altitude");
  EXPECT_EQ(Prediction(position, {{1, 2, 120}, {-2}}), std::vector<double>{118});
  ExpectTrueJacobian(position, {{1, 2, 120}, {-2}});
}

// The table of the standard atmosphere: 101325 Pa at 0 m, 89874.6 Pa at 1000 m, 54019.9 Pa at
// 5000 m, 22632.1 Pa at 11000 m. The tolerance is that of the rounded constants.
TEST(Altitude, IsThePressureOfTheStandardAtmosphere) {
  const SharedSensor sensor = MakeSensor(Altitude<1, true>(10.0), "altitude");
  for (const auto& [height, pressure] :
       {std::pair(0.0, 101325.0), {1000.0, 89874.6}, {5000.0, 54019.9}, {11000.0, 22632.1}}) {
    EXPECT_NEAR(Prediction(sensor, {{height}, {0}})[0], pressure, 1.0);
  }
  EXPECT_NEAR(Prediction(sensor, {{0}, {50}})[0], 101375.0, 1e-9);
  // d p / d h = -rho g = -1.225 kg/m^3 * 9.80665 m/s^2 at sea level
  EXPECT_NEAR(SensorJacobian(sensor, {{0}, {0}})[0], -1.225 * 9.80665, 1e-3);
}

TEST(Altitude, HasNoPressureAboveTheAtmosphere) {
  const SharedSensor sensor = MakeSensor(Altitude<1, true>(10.0), "altitude");
  Prediction(sensor, {{44330}, {0}});
  ExpectOutOfDomain(sensor, {{44332}, {0}});
}

}  // namespace
}  // namespace alidade
