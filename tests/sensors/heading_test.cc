// SPDX-License-Identifier: Apache-2.0
#include "sensors/heading.h"

#include <gtest/gtest.h>

#include "support/sensor_checks.h"

namespace alidade {
namespace {

using namespace testing;

// With a declination of 0.1 rad to the east, a compass reads 0.1 rad more, counter-clockwise.
TEST(Heading, AddsDeclinationAndBias) {
  const SharedSensor sensor = MakeSensor(HeadingOfAngle(0.02, 0.1), "heading");
  const Blocks roles{{3.0}, {0.25}};
  ExpectSame(Prediction(sensor, roles), {3.35 - 2.0 * M_PI}, 1e-15);
  EXPECT_EQ(NoiseDiagonal(sensor, roles), std::vector<double>{0.02});
  ExpectSame(Initialised(sensor, roles, {3.35 - 2.0 * M_PI}), {3.0}, 1e-15);
  ExpectTrueJacobian(sensor, roles);
}

// Yaw 0.8, then pitch 0.5, then roll -0.3 rad.
TEST(Heading, IsTheYawOfAnOrientation) {
  const SharedSensor sensor = MakeSensor(HeadingOfOrientation(0.02, 0.1), "heading");
  const Eigen::Quaterniond q = Eigen::AngleAxisd(0.8, Eigen::Vector3d::UnitZ()) *
                               Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitY()) *
                               Eigen::AngleAxisd(-0.3, Eigen::Vector3d::UnitX());
  const Blocks roles{{q.w(), q.x(), q.y(), q.z()}, {0.25}};
  ExpectSame(Prediction(sensor, roles), {1.15}, 1e-15);
  ExpectTrueJacobian(sensor, roles);
}

TEST(Heading, IsNotDefinedForAVerticalBody) {
  const SharedSensor sensor = MakeSensor(HeadingOfOrientation(0.02), "heading");
  for (const double sign : {1.0, -1.0}) {
    ExpectOutOfDomain(sensor, {{kRoot, 0, sign * kRoot, 0}, {0}});
  }
}

}  // namespace
}  // namespace alidade
