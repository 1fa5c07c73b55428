// SPDX-License-Identifier: Apache-2.0
#include "sensors/range.h"

#include <gtest/gtest.h>

#include "alidade/model/fixed_known.h"
#include "support/sensor_checks.h"

namespace alidade {
namespace {

using namespace testing;

// The body is at (1, 2) m and heads along y. The antenna is 1 m ahead of it, at (1, 3) m. The point
// is 3 m east and 4 m north of the antenna. Bias 0.5 m.
TEST(RangeToPoint, IsTheDistancePlusBias) {
  const SharedSensor sensor = MakeSensor(RangeToPoint<2>(0.1), "range");
  const Blocks roles{{1, 2}, {M_PI / 2}, {1, 0}, {0.5}};
  const double point[2] = {4, 7};
  ExpectSame(Prediction(sensor, roles, point), {5.5}, 1e-15);
  EXPECT_EQ(NoiseDiagonal(sensor, roles, point), std::vector<double>{0.1});
  ExpectTrueJacobian(sensor, roles, point);
  EXPECT_EQ(ColumnNames("p", sensor->known()), (std::vector<std::string>{"p.x", "p.y"}));
}

TEST(RangeToPoint, HasTheSameValueForAFixedPoint) {
  const Eigen::Vector3d p(1, -2, 3), arm(0.5, -0.2, 1.5), point(4, 5, -6);
  const SharedSensor fixed =
      MakeSensor(FixedKnown<RangeToPoint<3>>(RangeToPoint<3>(0.1), {4, 5, -6}), "range");
  EXPECT_EQ(fixed->known_size(), 0);
  const Blocks roles{Elements(p), kAttitude, Elements(arm), {-0.25}};
  const double z = (p + RotationMatrix(kAttitude) * arm - point).norm() - 0.25;
  ExpectSame(Prediction(fixed, roles), {z}, 1e-15);
  EXPECT_EQ(NoiseDiagonal(fixed, roles), std::vector<double>{0.1});
  ExpectTrueJacobian(fixed, roles);
}

TEST(RangeToPoint, IsNotDefinedAtThePoint) {
  const SharedSensor sensor = MakeSensor(RangeToPoint<2>(0.1), "range");
  const double point[2] = {4, 7};
  ExpectOutOfDomain(sensor, {{3, 7}, {}, {1, 0}, {0}}, point);
}

}  // namespace
}  // namespace alidade
