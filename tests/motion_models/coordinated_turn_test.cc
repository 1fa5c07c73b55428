// SPDX-License-Identifier: Apache-2.0
#include "motion_models/coordinated_turn.h"

#include <gtest/gtest.h>

#include "support/integration.h"
#include "support/model_maker.h"

namespace alidade {
namespace {

using testing::AbiMotion;
using testing::Blocks;
using testing::StepWithJacobians;

const Blocks kState{{1, 2}, {0.5}, {3}, {-0.7}};

SharedMotion Make() {
  return AbiMotion<CoordinatedTurn>(
      {{"noise.acceleration", {0.4}}, {"noise.angular_acceleration", {0.3}}});
}

TEST(CoordinatedTurn, IsTheSolutionOfItsDifferentialEquation) {
  for (const double omega : {-0.7, 0.0, 1e-6, 4.0}) {
    Blocks x = kState;
    x[3] = {omega};
    const Blocks next = StepWithJacobians(Make(), x, nullptr, nullptr, 1.3).next;
    const Eigen::Vector3d expected =
        testing::RungeKutta(Eigen::Vector3d(1, 2, 0.5), 1.3, [&](const Eigen::Vector3d& y) {
          return Eigen::Vector3d(3 * std::cos(y[2]), 3 * std::sin(y[2]), omega);
        });
    EXPECT_NEAR(next[0][0], expected[0], 1e-10);
    EXPECT_NEAR(next[0][1], expected[1], 1e-10);
    EXPECT_NEAR(std::remainder(next[1][0] - expected[2], 2 * M_PI), 0, 1e-10);
    EXPECT_EQ(next[2][0], 3);
    EXPECT_EQ(next[3][0], omega);
    testing::ExpectTrueJacobians(Make(), x, nullptr, {0.1, -0.05, 0.2, 0.1}, 0.1);
    testing::ExpectAdditive(Make(), x, nullptr, 0.4, 0.9);
  }
}

TEST(CoordinatedTurn, HasTheNoiseOfWhiteAccelerations) {
  EXPECT_FALSE(Make()->discrete_noise());
  // Independent formula for a straight path along x, linearised: x'' = w_a, y' = v h,
  // h'' = w_alpha.
  Eigen::MatrixXd f = Eigen::MatrixXd::Zero(5, 5), q = f;
  f(0, 3) = f(2, 4) = 1.0;
  f(1, 2) = 3.0;
  q(3, 3) = 0.16;
  q(4, 4) = 0.09;
  const Blocks straight{{1, 2}, {0}, {3}, {0}};
  const Eigen::MatrixXd expected = testing::IntegratedNoise(f, q, 0.8);
  testing::ExpectSameCovariance(testing::NoiseOfSteps(Make(), straight, nullptr, 0.8, 300),
                                expected, 1e-4);
  // One step is exact except across the path, where the variance is 5/3 of the true one.
  const Eigen::MatrixXd once = testing::NoiseOfSteps(Make(), straight, nullptr, 0.8, 1);
  for (const int r : {0, 2, 3, 4}) {
    for (const int c : {0, 2, 3, 4}) EXPECT_NEAR(once(r, c), expected(r, c), 1e-12);
  }
  EXPECT_NEAR(once(1, 1), 5.0 / 3.0 * expected(1, 1), 1e-12);
}

}  // namespace
}  // namespace alidade
