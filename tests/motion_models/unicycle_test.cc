// SPDX-License-Identifier: Apache-2.0
#include "motion_models/unicycle.h"

#include <gtest/gtest.h>

#include "support/integration.h"
#include "support/model_maker.h"

namespace alidade {
namespace {

using testing::AbiMotion;
using testing::Blocks;
using testing::StepWithJacobians;

const double kPi = 3.14159265358979323846;

std::shared_ptr<const PluginMotion> Make(int kind) {
  return AbiMotion<Unicycle>(
      {{"noise.kind", {double(kind)}}, {"noise.speed", {0.3}}, {"noise.turn_rate", {0.2}}});
}

void ExpectPose(const Blocks& pose, double x, double y, double heading) {
  EXPECT_NEAR(pose[0][0], x, 1e-13);
  EXPECT_NEAR(pose[0][1], y, 1e-13);
  EXPECT_NEAR(pose[1][0], heading, 1e-13);
}

TEST(Unicycle, DrivesOnArcs) {
  const auto motion = Make(0);
  // 2 m/s for 3 s along y, then a quarter circle of radius 4 m to the left and to the right.
  const double straight[2] = {2, 0}, left[2] = {2 * kPi, kPi / 2}, right[2] = {2 * kPi, -kPi / 2};
  ExpectPose(StepWithJacobians(motion, {{5, 6}, {kPi / 2}}, straight, nullptr, 3.0).next, 5, 12,
             kPi / 2);
  ExpectPose(StepWithJacobians(motion, {{5, 6}, {0}}, left, nullptr, 1.0).next, 9, 10, kPi / 2);
  ExpectPose(StepWithJacobians(motion, {{5, 6}, {0}}, right, nullptr, 1.0).next, 9, 2, -kPi / 2);
  // Nearly straight: 0.005 rad on a circle of radius 400 m. The chord rises by 2 R sin^2(0.0025).
  const double bend[2] = {2, 0.005}, half = std::sin(0.0025);
  ExpectPose(StepWithJacobians(motion, {{0, 0}, {0}}, bend, nullptr, 1.0).next,
             400 * std::sin(0.005), 800 * half * half, 0.005);
  // The noise adds to the input. The heading wraps.
  const double none[2] = {};
  ExpectPose(StepWithJacobians(motion, {{5, 6}, {3 * kPi / 4}}, none, left, 1.0).next,
             5 - 4 * std::sqrt(2), 6, -3 * kPi / 4);
}

TEST(Unicycle, StepsOfAnyLengthAreExact) {
  const Blocks x{{1, 2}, {0.5}};
  const std::vector<double> w{0.2, -0.3};
  for (const double omega : {0.0, 1e-7, -0.4, 3.0, 20.0}) {
    const double u[2] = {1.5, omega};
    testing::ExpectTrueJacobians(Make(0), x, u, w, 0.1);
    testing::ExpectAdditive(Make(0), x, u, 0.3, 0.9);
  }
}

TEST(Unicycle, NoiseOfEitherKindIsThatOfTheWholeGap) {
  const Blocks x{{1, 2}, {0.5}};
  const double u[2] = {1.5, 0.4};
  EXPECT_FALSE(Make(0)->discrete_noise());
  EXPECT_TRUE(Make(1)->discrete_noise());
  for (const int kind : {0, 1}) {
    EXPECT_LT(testing::DefectOfParts(Make(kind), x, u, 0.5e-3, 0.5e-3), 1e-3);
  }
  EXPECT_NEAR(testing::Covariance(Make(0), x, 0.1)[0], 0.09 / 0.1, 1e-15);
  EXPECT_NEAR(testing::Covariance(Make(1), x, 0.1)[3], 0.04, 1e-15);
  // White noise on a straight path along x: Var(x) = 0.09 t, Var(h) = 0.04 t, and the lateral
  // displacement y = v integral(h) has the variance v^2 0.04 t^3 / 3.
  const double straight[2] = {1.5, 0};
  const Eigen::MatrixXd q = testing::NoiseOfSteps(Make(0), {{0, 0}, {0}}, straight, 2.0, 1000);
  EXPECT_NEAR(q(0, 0), 0.18, 1e-9);
  EXPECT_NEAR(q(2, 2), 0.08, 1e-9);
  EXPECT_NEAR(q(1, 1), 1.5 * 1.5 * 0.04 * 8 / 3, 1e-5);
  EXPECT_NEAR(q(1, 2), 1.5 * 0.04 * 2, 1e-6);
}

}  // namespace
}  // namespace alidade
