// SPDX-License-Identifier: Apache-2.0
#include "motion_models/planar_body_velocity.h"

#include <gtest/gtest.h>

#include "support/integration.h"
#include "support/model_maker.h"

namespace alidade {
namespace {

using testing::AbiMotion;
using testing::Blocks;
using testing::StepWithJacobians;

const Blocks kState{{1, 2}, {0.5}, {3, -1}, {-0.7}};

SharedMotion Make() {
  return AbiMotion<PlanarBodyVelocity>(
      {{"noise.linear_acceleration", {0.4, 0.1}}, {"noise.angular_acceleration", {0.3}}});
}

TEST(PlanarBodyVelocity, IsTheSolutionOfItsDifferentialEquation) {
  for (const double omega : {-0.7, 0.0, 1e-6, 4.0}) {
    Blocks x = kState;
    x[3] = {omega};
    const Blocks next = StepWithJacobians(Make(), x, nullptr, nullptr, 1.3).next;
    const Eigen::Vector3d expected =
        testing::RungeKutta(Eigen::Vector3d(1, 2, 0.5), 1.3, [&](const Eigen::Vector3d& y) {
          return Eigen::Vector3d(3 * std::cos(y[2]) + std::sin(y[2]),
                                 3 * std::sin(y[2]) - std::cos(y[2]), omega);
        });
    EXPECT_NEAR(next[0][0], expected[0], 1e-10);
    EXPECT_NEAR(next[0][1], expected[1], 1e-10);
    EXPECT_NEAR(std::remainder(next[1][0] - expected[2], 2 * M_PI), 0, 1e-10);
    EXPECT_EQ(next[2], x[2]);
    EXPECT_EQ(next[3][0], omega);
    testing::ExpectTrueJacobians(Make(), x, nullptr, {0.1, -0.05, 0.2, 0.1, 0.3, -0.1}, 0.1);
    testing::ExpectAdditive(Make(), x, nullptr, 0.4, 0.9);
  }
}

// A body that slides to its left: with v = (0, 2 m/s) and a quarter turn in 1 s, it moves on the
// arc that a body driving forward from the heading pi/2 describes.
TEST(PlanarBodyVelocity, MovesSideways) {
  const Blocks next =
      StepWithJacobians(Make(), {{0, 0}, {0}, {0, M_PI}, {M_PI / 2}}, nullptr, nullptr, 1.0).next;
  EXPECT_NEAR(next[0][0], -2, 1e-14);
  EXPECT_NEAR(next[0][1], 2, 1e-14);
}

TEST(PlanarBodyVelocity, HasTheNoiseOfWhiteAccelerations) {
  // Linearised for heading 0, v = (3, -1), omega = 0: x' = v_x + h, y' = v_y + 3 h.
  Eigen::MatrixXd f = Eigen::MatrixXd::Zero(6, 6), q = f;
  f(0, 3) = f(1, 4) = f(2, 5) = 1.0;
  f(0, 2) = 1.0;
  f(1, 2) = 3.0;
  q.diagonal() << 0, 0, 0, 0.16, 0.01, 0.09;
  const Blocks straight{{1, 2}, {0}, {3, -1}, {0}};
  testing::ExpectSameCovariance(testing::NoiseOfSteps(Make(), straight, nullptr, 0.8, 300),
                                testing::IntegratedNoise(f, q, 0.8), 1e-4);
}

}  // namespace
}  // namespace alidade
