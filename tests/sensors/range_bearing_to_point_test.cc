// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "alidade/model/fixed_known.h"
#include "sensors/range_bearing.h"
#include "support/sensor_checks.h"

namespace alidade {
namespace {

using namespace testing;

// The body is at (1, 2) m and heads along y. The sensor is 1 m ahead and looks to the left, along
// -x. The point is 3 m behind the sensor and 2 m to its right.
TEST(RangeBearingToPoint, InThePlane) {
  const SharedSensor sensor = MakeSensor(
      FixedKnown<RangeBearingToPoint<2>>(RangeBearingToPoint<2>(0.1, 0.02, 5), {4, 5}), "s");
  const Blocks roles{{1, 2}, {M_PI / 2}, {1, 0}, {M_PI / 2}};
  ExpectSame(Prediction(sensor, roles), {std::sqrt(13.0), std::atan2(-2, -3)}, 1e-15);
  EXPECT_EQ(NoiseDiagonal(sensor, roles), (std::vector<double>{0.1, 0.02}));
  ExpectTrueJacobian(sensor, roles);
  ExpectOutOfDomain(sensor, {{3, 5}, {0}, {1, 0}, {0}});
  for (const auto& [range, status] :
       {std::pair(5.0, Status::kOk), {5.1, Status::kInvalid}, {0.0, Status::kInvalid}}) {
    const double z[2] = {range, 1};
    EXPECT_EQ(sensor->Valid({z}), status);
  }
}

TEST(RangeBearingToPoint, InSpace) {
  const SharedSensor sensor = MakeSensor(RangeBearingToPoint<3>(0.1, 0.02, 5), "s");
  const Blocks roles{{1, -2, 3}, kAttitude, {0.3, 0.1, -0.2}, kQuarterTurn};
  const Eigen::Vector3d point(4, 5, 6), arm(0.3, 0.1, -0.2);
  const Eigen::Vector3d in_body =
      RotationMatrix(kAttitude).transpose() * (point - Eigen::Vector3d(1, -2, 3)) - arm;
  const Eigen::Vector3d h = RotationMatrix(kQuarterTurn).transpose() * in_body, u = h.normalized();
  ExpectSame(Prediction(sensor, roles, point.data()), {h.norm(), u[0], u[1], u[2]}, 1e-14);
  EXPECT_EQ(NoiseDiagonal(sensor, roles, point.data()), (std::vector<double>{0.1, 0.02, 0.02}));
  ExpectTrueJacobian(sensor, roles, point.data());
  const Eigen::Vector3d here(1, -2, 3);
  ExpectOutOfDomain(sensor, {roles[0], kNeutral, {0, 0, 0}, kNeutral}, here.data());
}

// At the same point, the model of a known point is the model of a landmark.
TEST(RangeBearingToPoint, IsTheModelOfALandmark) {
  const SharedSensor landmark = MakeSensor(RangeBearing<Xyz>(0.1, 0.02), "landmark");
  const SharedSensor sensor = MakeSensor(RangeBearingToPoint<3>(0.1, 0.02), "point");
  const std::vector<double> point{4, 5, 6};
  ExpectSame(Prediction(sensor, {{1, -2, 3}, kAttitude, {0, 0, 0}, kNeutral}, point.data()),
             Prediction(landmark, {{1, -2, 3}, kAttitude, point}), 1e-14);
}

}  // namespace
}  // namespace alidade
