// SPDX-License-Identifier: Apache-2.0
#include "sensors/direct.h"

#include <gtest/gtest.h>

#include "support/sensor_checks.h"

namespace alidade {
namespace {

using namespace testing;

TEST(Direct, MeasuresAVectorPlusItsBias) {
  const SharedSensor sensor = MakeSensor(Direct<Vec<3>>({0.1, 0.2, 0.3}), "direct");
  const Blocks roles{{1, -2, 3}, {0.5, 0.25, -1}};
  EXPECT_EQ(Prediction(sensor, roles), (std::vector<double>{1.5, -1.75, 2}));
  EXPECT_EQ(NoiseDiagonal(sensor, roles), (std::vector<double>{0.1, 0.2, 0.3}));
  EXPECT_EQ(Initialised(sensor, roles, {1.5, -1.75, 2}), roles[0]);
  ExpectTrueJacobian(sensor, roles);
}

// 3 rad + 0.5 rad is 3.5 rad - 2 pi.
TEST(Direct, WrapsAnAngle) {
  const SharedSensor sensor = MakeSensor(Direct<Angle>({0.1}), "direct");
  const Blocks roles{{3.0}, {0.5}};
  ExpectSame(Prediction(sensor, roles), {3.5 - 2.0 * M_PI}, 1e-15);
  ExpectSame(Initialised(sensor, roles, {3.5 - 2.0 * M_PI}), {3.0}, 1e-15);
  ExpectTrueJacobian(sensor, roles);
}

// The bias is a rotation vector in the frame of the body: 0.2 rad about x.
TEST(Direct, RotatesAnOrientationByItsBias) {
  const SharedSensor sensor = MakeSensor(Direct<UnitQuaternion>({0.1, 0.1, 0.1}), "direct");
  const Blocks roles{kQuarterTurn, {0.2, 0, 0}};
  const Eigen::Quaterniond z =
      Eigen::Quaterniond(kRoot, 0, 0, kRoot) * Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitX());
  ExpectSame(Prediction(sensor, roles), {z.w(), z.x(), z.y(), z.z()}, 1e-15);
  ExpectSame(Initialised(sensor, roles, Prediction(sensor, roles)), kQuarterTurn, 1e-15);
  EXPECT_EQ(NoiseDiagonal(sensor, roles).size(), 3u);
  ExpectTrueJacobian(sensor, roles);
}

TEST(Direct, MeasuresAUnitVector) {
  const SharedSensor sensor = MakeSensor(Direct<UnitVector>({0.1, 0.1}), "direct");
  EXPECT_EQ(Prediction(sensor, {{0, 0.6, 0.8}, {0, 0}}), (std::vector<double>{0, 0.6, 0.8}));
  ExpectTrueJacobian(sensor, {{0, 0.6, 0.8}, {0.0, 0.0}});
}

TEST(Direct, HasAConstantBiasOfZeroByDefault) {
  const SharedSensor sensor = MakeSensor(Direct<Vec<1>>({0.1}), "direct");
  EXPECT_NE(sensor->roles()[1].flags & ALIDADE_ROLE_OWNED, 0u);
  EXPECT_TRUE(sensor->owned(1).sqrt_prior.empty());
  EXPECT_EQ(sensor->owned(1).mean, std::vector<double>{0.0});
}

}  // namespace
}  // namespace alidade
