// SPDX-License-Identifier: Apache-2.0
#include "motion_models/body_velocity.h"

#include <gtest/gtest.h>

#include "motion_models/planar_body_velocity.h"
#include "support/integration.h"
#include "support/model_maker.h"

namespace alidade {
namespace {

using testing::AbiMotion;
using testing::Blocks;
using testing::StepWithJacobians;

const Blocks kState{{1, 2, 3}, {0.8, 0.2, -0.4, 0.4}, {1, -2, 0.5}, {0.3, -0.6, 0.9}};

SharedMotion Make() {
  return AbiMotion<BodyVelocityMotion>({{"noise.linear_acceleration", {0.4, 0.1, 0.2}},
                                        {"noise.angular_acceleration", {0.3, 0.2, 0.1}}});
}

TEST(BodyVelocityMotion, IsTheSolutionOfItsDifferentialEquation) {
  using State = Eigen::Matrix<double, 7, 1>;
  for (const double scale : {0.0, 1e-6, 1.0, 5.0}) {
    Blocks x = kState;
    for (double& element : x[3]) element *= scale;
    const Blocks next = StepWithJacobians(Make(), x, nullptr, nullptr, 1.3).next;
    State start;
    start << 1, 2, 3, 0.8, 0.2, -0.4, 0.4;
    const State expected = testing::RungeKutta(start, 1.3, [&](const State& y) {
      const double turn[4] = {0, 0.5 * x[3][0], 0.5 * x[3][1], 0.5 * x[3][2]};
      State change;
      UnitQuaternion::Rotate(y.data() + 3, x[2].data(), change.data());
      UnitQuaternion::Multiply(y.data() + 3, turn, change.data() + 3);  // q' = q (0, omega) / 2
      return change;
    });
    for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(next[0][i], expected[i], 1e-9);
    double d[3];
    UnitQuaternion::Minus(next[1].data(), expected.data() + 3, d);
    for (const double element : d) EXPECT_NEAR(element, 0.0, 1e-9);
    EXPECT_EQ(next[2], x[2]);
    EXPECT_EQ(next[3], x[3]);
    const std::vector<double> w{0.1, -0.1, 0.2, 0.05, -0.1, 0.1, 0.3, 0.2, 0.1, 0.1, 0.2, 0.3};
    testing::ExpectTrueJacobians(Make(), x, nullptr, w, 0.1);
    testing::ExpectAdditive(Make(), x, nullptr, 0.4, 0.9);
  }
}

TEST(BodyVelocityMotion, IsPlanarInThePlane) {
  const Blocks next =
      StepWithJacobians(
          Make(), {{1, 2, 0}, {std::cos(0.25), 0, 0, std::sin(0.25)}, {3, -1, 0}, {0, 0, -0.7}},
          nullptr, nullptr, 1.3)
          .next;
  const auto planar = AbiMotion<PlanarBodyVelocity>(
      {{"noise.linear_acceleration", {0}}, {"noise.angular_acceleration", {0}}});
  const Blocks expected =
      StepWithJacobians(planar, {{1, 2}, {0.5}, {3, -1}, {-0.7}}, nullptr, nullptr, 1.3).next;
  EXPECT_NEAR(next[0][0], expected[0][0], 1e-13);
  EXPECT_NEAR(next[0][1], expected[0][1], 1e-13);
  EXPECT_NEAR(next[0][2], 0, 1e-13);
  EXPECT_NEAR(2 * std::atan2(next[1][3], next[1][0]), expected[1][0], 1e-13);
}

TEST(BodyVelocityMotion, HasTheNoiseOfWhiteAccelerations) {
  // Linearised for q = I, omega = 0 and v = (3, 0, 0): y' = v_y + 3 theta_z, z' = v_z - 3 theta_y.
  Eigen::MatrixXd f = Eigen::MatrixXd::Zero(12, 12), q = f;
  for (int i = 0; i < 3; ++i) f(i, 6 + i) = f(3 + i, 9 + i) = 1.0;
  f(1, 5) = 3.0;
  f(2, 4) = -3.0;
  q.diagonal().tail<6>() << 0.16, 0.01, 0.04, 0.09, 0.04, 0.01;
  testing::ExpectSameCovariance(
      testing::NoiseOfSteps(Make(), {{0, 0, 0}, {1, 0, 0, 0}, {3, 0, 0}, {0, 0, 0}}, nullptr, 0.8,
                            300),
      testing::IntegratedNoise(f, q, 0.8), 1e-4);
}

}  // namespace
}  // namespace alidade
