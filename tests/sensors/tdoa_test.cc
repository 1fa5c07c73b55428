// SPDX-License-Identifier: Apache-2.0
#include "sensors/tdoa.h"

#include <gtest/gtest.h>

#include "alidade/model/fixed_known.h"
#include "support/sensor_checks.h"

namespace alidade {
namespace {

using namespace testing;

// The anchor is at a distance of 5 m, the reference anchor at 13 m.
TEST(Tdoa, IsTheDifferenceOfTheRanges) {
  const SharedSensor sensor = MakeSensor(Tdoa<2>(0.1), "tdoa");
  const Blocks roles{{1, 2}, {0.25}};
  const double anchors[4] = {4, 6, -4, 14};
  ExpectSame(Prediction(sensor, roles, anchors), {-7.75}, 1e-15);
  EXPECT_EQ(NoiseDiagonal(sensor, roles, anchors), std::vector<double>{0.1});
  ExpectTrueJacobian(sensor, roles, anchors);
  EXPECT_EQ(ColumnNames("k", sensor->known())[3], "k.reference_y");
}

TEST(Tdoa, HasTheSameValueForFixedAnchors) {
  const SharedSensor sensor =
      MakeSensor(FixedKnown<Tdoa<3>>(Tdoa<3>(0.1), {3, 2, 6, 2, -1, 1}), "tdoa");
  const Eigen::Vector3d p(1, -2, 3), a(3, 2, 6), c(2, -1, 1);
  const Blocks roles{Elements(p), {0}};
  ExpectSame(Prediction(sensor, roles), {(p - a).norm() - (p - c).norm()}, 1e-15);
  ExpectTrueJacobian(sensor, roles);
}

TEST(Tdoa, IsNotDefinedAtAnAnchor) {
  const SharedSensor sensor = MakeSensor(Tdoa<2>(0.1), "tdoa");
  const double anchors[4] = {1, 2, 3, 4};
  ExpectOutOfDomain(sensor, {{1, 2}, {0}}, anchors);
  ExpectOutOfDomain(sensor, {{3, 4}, {0}}, anchors);
}

}  // namespace
}  // namespace alidade
