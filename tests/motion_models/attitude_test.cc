// SPDX-License-Identifier: Apache-2.0
#include "motion_models/attitude.h"

#include <gtest/gtest.h>

#include "support/integration.h"
#include "support/model_maker.h"

namespace alidade {
namespace {

using testing::AbiMotion;
using testing::Blocks;
using testing::StepWithJacobians;

SharedMotion Make() {
  return AbiMotion<Attitude>({{"noise.gyro", {0.1, 0.2, 0.3}}, {"noise.gyro_bias", {0.05}}});
}

TEST(Attitude, IntegratesTheGyroscope) {
  // A quarter turn about z in 2 s. The gyroscope reads 0.1 rad/s too much about each axis.
  const double u[3] = {0.1, 0.1, M_PI / 4 + 0.1};
  const Blocks next =
      StepWithJacobians(Make(), {{1, 0, 0, 0}, {0.1, 0.1, 0.1}}, u, nullptr, 2.0).next;
  const double expected[4] = {std::sqrt(0.5), 0, 0, std::sqrt(0.5)};
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(next[0][i], expected[i], 1e-14);
  EXPECT_EQ(next[1], (std::vector<double>{0.1, 0.1, 0.1}));
  // Noise is subtracted from the reading, as the bias is.
  const double none[3] = {}, w[6] = {0, 0, -M_PI / 4};
  const Blocks moved = StepWithJacobians(Make(), {{1, 0, 0, 0}, {0, 0, 0}}, none, w, 2.0).next;
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(moved[0][i], expected[i], 1e-14);
}

TEST(Attitude, HasTrueJacobiansAndWhiteNoise) {
  const Blocks x{{0.8, 0.2, -0.4, 0.4}, {0.1, -0.2, 0.3}};
  const double u[3] = {0.5, -0.7, 0.2}, still[3] = {0.1, -0.2, 0.3};
  for (const double* input : {u, still}) {
    testing::ExpectTrueJacobians(Make(), x, input, std::vector<double>(6), 0.1);
    testing::ExpectAdditive(Make(), x, input, 0.3, 1.4);
  }
  // An angle random walk, Var(theta) = sigma^2 t for each axis. The walk of the bias has the
  // variance sigma_b^2 t, and adds sigma_b^2 t^3 / 3 to Var(theta).
  const Eigen::MatrixXd q = testing::NoiseOfSteps(Make(), x, still, 0.7, 700);
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(q(i, i), 0.01 * (i + 1) * (i + 1) * 0.7 + 0.0025 * 0.343 / 3, 1e-5);
    EXPECT_NEAR(q(3 + i, 3 + i), 0.0025 * 0.7, 1e-14);
  }
}

}  // namespace
}  // namespace alidade
