// SPDX-License-Identifier: Apache-2.0
#include "sensors/bearing.h"

#include <gtest/gtest.h>

#include "alidade/model/fixed_known.h"
#include "support/sensor_checks.h"

namespace alidade {
namespace {

using namespace testing;

// The body is at (1, 2) m and heads along y. The sensor is 1 m ahead of it, at (1, 3) m, and looks
// to the left, along -x. The point is 2 m further to the left and 2 m ahead: 45 degrees to the
// right of the sensor.
TEST(Bearing, IsAnAngleInThePlane) {
  const SharedSensor sensor = MakeSensor(Bearing(0.1), "bearing");
  const Blocks roles{{1, 2}, {M_PI / 2}, {1, 0}, {M_PI / 2}};
  const double point[2] = {-1, 5};
  ExpectSame(Prediction(sensor, roles, point), {-M_PI / 4}, 1e-15);
  EXPECT_EQ(NoiseDiagonal(sensor, roles, point), std::vector<double>{0.1});
  ExpectTrueJacobian(sensor, roles, point);
  const double at_sensor[2] = {1, 3};
  ExpectOutOfDomain(sensor, {{1, 3}, {0}, {0, 0}, {0}}, at_sensor);
}

TEST(Bearing, IsAUnitVectorOrTwoAnglesInSpace) {
  const Eigen::Vector3d p(1, -2, 3), arm(0.5, -0.2, 1.5), point(4, 5, -6);
  const std::vector<double> mounting{0.1, 0.7, 0.7, -0.1};
  const Eigen::Vector3d h = RotationMatrix(mounting).transpose() *
                            (RotationMatrix(kAttitude).transpose() * (point - p) - arm);
  const Blocks roles{Elements(p), kAttitude, Elements(arm), mounting};
  const SharedSensor vector =
      MakeSensor(FixedKnown<BearingUnitVector>(BearingUnitVector(0.1), {4, 5, -6}), "bearing");
  ExpectSame(Prediction(vector, roles), Elements(h.normalized()), 1e-15);
  EXPECT_EQ(NoiseDiagonal(vector, roles), (std::vector<double>{0.1, 0.1}));
  ExpectTrueJacobian(vector, roles);
  const SharedSensor angles =
      MakeSensor(FixedKnown<BearingAngles>(BearingAngles(0.1), {4, 5, -6}), "bearing");
  ExpectSame(Prediction(angles, roles), {std::atan2(h[1], h[0]), std::asin(h.normalized()[2])},
             1e-14);
  ExpectTrueJacobian(angles, roles);
}

TEST(Bearing, HasNoAzimuthStraightUp) {
  const double above[3] = {0, 0, 2};
  const Blocks roles{{0, 0, 0}, kNeutral, {0, 0, 0}, kNeutral};
  ExpectOutOfDomain(MakeSensor(BearingAngles(0.1), "bearing"), roles, above);
  Prediction(MakeSensor(BearingUnitVector(0.1), "bearing"), roles, above);
  ExpectOutOfDomain(MakeSensor(BearingUnitVector(0.1), "bearing"), roles, roles[0].data());
}

}  // namespace
}  // namespace alidade
