// SPDX-License-Identifier: Apache-2.0
#include "sensors/speed.h"

#include <gtest/gtest.h>

#include "support/sensor_checks.h"

namespace alidade {
namespace {

using namespace testing;

// |(2, -3, 6)| = 7 m/s, 1.1 * 7 + 0.5 = 8.2 m/s.
TEST(Speed, IsTheLengthOfTheVelocity) {
  const SharedSensor sensor = MakeSensor(Speed<3>(0.1), "speed");
  const Blocks roles{{2, -3, 6}, {0.1}, {0.5}};
  ExpectSame(Prediction(sensor, roles), {8.2}, 1e-15);
  EXPECT_EQ(NoiseDiagonal(sensor, roles), std::vector<double>{0.1});
  ExpectTrueJacobian(sensor, roles);
  ExpectSame(Prediction(MakeSensor(Speed<1>(0.1), "speed"), {{-3}, {0}, {0}}), {3}, 0.0);
}

TEST(Speed, IsNotDefinedAtRest) {
  ExpectOutOfDomain(MakeSensor(Speed<2>(0.1), "speed"), {{0, 0}, {0}, {0}});
}

}  // namespace
}  // namespace alidade
