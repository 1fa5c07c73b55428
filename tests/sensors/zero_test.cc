// SPDX-License-Identifier: Apache-2.0
#include "sensors/zero.h"

#include <gtest/gtest.h>

#include "support/sensor_checks.h"

namespace alidade {
namespace {

using namespace testing;

TEST(ZeroVelocity, IsTheVelocity) {
  const SharedSensor sensor = MakeSensor(ZeroVelocity<3>(0.02), "zero");
  EXPECT_EQ(Prediction(sensor, {{1, -2, 3}}), (std::vector<double>{1, -2, 3}));
  EXPECT_EQ(NoiseDiagonal(sensor, {{1, -2, 3}}), (std::vector<double>{0.02, 0.02, 0.02}));
  ExpectTrueJacobian(sensor, {{1, -2, 3}});
}

}  // namespace
}  // namespace alidade
