// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "sensors/pose.h"
#include "sensors/relative_pose.h"
#include "support/sensor_checks.h"

namespace alidade {
namespace {

using namespace testing;

TEST(PlanarPose, IsPositionAndHeading) {
  const SharedSensor pose = MakeSensor(Pose<2>({0.1, 0.2}, {0.03}), "pose");
  const Blocks roles{{1, -2}, {0.5}};
  EXPECT_EQ(Prediction(pose, roles), (std::vector<double>{1, -2, 0.5}));
  EXPECT_EQ(pose->measurement().elements.back(), "heading");
  EXPECT_EQ(NoiseDiagonal(pose, roles), (std::vector<double>{0.1, 0.2, 0.03}));
  ExpectTrueJacobian(pose, roles);
  EXPECT_EQ(Initialised(pose, roles, {4, 5, 1}), (std::vector<double>{4, 5}));
}

// The body is at (1, 2) m and heads along y. The landmark is 4 m ahead and 3 m to the right, and
// heads along -x, 90 degrees to the left of the body.
TEST(PlanarPose, IsThatOfALandmarkInTheBody) {
  const SharedSensor sensor = MakeSensor(RelativePose<2>({0.1, 0.2}, {0.03}), "relative_pose");
  const Blocks roles{{1, 2}, {M_PI / 2}, {4, 6}, {M_PI}};
  ExpectSame(Prediction(sensor, roles), {4, -3, M_PI / 2}, 1e-15);
  EXPECT_EQ(NoiseDiagonal(sensor, roles), (std::vector<double>{0.1, 0.2, 0.03}));
  ExpectTrueJacobian(sensor, roles);
}

TEST(PlanarPose, WrapsTheRelativeHeading) {
  const SharedSensor sensor = MakeSensor(RelativePose<2>({0.1, 0.2}, {0.03}), "relative_pose");
  ExpectSame(Prediction(sensor, {{0, 0}, {-3}, {0, 0}, {3}}), {0, 0, 6 - 2 * M_PI}, 1e-15);
}

TEST(PlanarPose, PlacesTheLandmarkWhereItWasMeasured) {
  const SharedSensor sensor = MakeSensor(RelativePose<2>({0.1, 0.2}, {0.03}), "relative_pose");
  ASSERT_EQ(sensor->inverse().role, 2);
  const Blocks roles{{1, 2}, {M_PI / 2}, {0, 0}, {0}};
  const std::vector<double> z{4, -3, M_PI / 2};
  std::vector<double> y(3, kPoison);
  ASSERT_EQ(sensor->Initialise(Pointers(roles).data(), {z.data()}, nullptr, {.y = y.data()}),
            Status::kOk);
  ExpectSame(y, {4, 6, M_PI}, 1e-15);
}

}  // namespace
}  // namespace alidade
