// SPDX-License-Identifier: Apache-2.0
#include "motion_models/constant_acceleration.h"

#include <gtest/gtest.h>

#include "support/integration.h"
#include "support/model_maker.h"

namespace alidade {
namespace {

using testing::AbiMotion;
using testing::Blocks;
using testing::StepWithJacobians;

template <int D, bool kContinuous>
void CheckConstantAcceleration() {
  const double sigma = 0.7, dt_s = 0.4;
  const SharedMotion motion =
      AbiMotion<ConstantAcceleration<D, kContinuous>>({{"noise.jerk", {sigma}}});
  ASSERT_EQ(motion->noise_size(), kContinuous ? 3 * D : D);
  EXPECT_EQ(motion->discrete_noise(), !kContinuous);
  Blocks x(3, std::vector<double>(D));
  for (int i = 0; i < D; ++i) x[0][i] = 1.0 + i, x[1][i] = 2.0 - 3.0 * i, x[2][i] = -1.0 + i;
  std::vector<double> w(static_cast<std::size_t>(motion->noise_size()));
  for (std::size_t i = 0; i < w.size(); ++i) w[i] = 0.3 - 0.1 * static_cast<double>(i);
  testing::ExpectTrueJacobians(motion, x, nullptr, w, dt_s);
  testing::ExpectAdditive(motion, x, nullptr, 0.3, 0.17);
  EXPECT_LT(testing::DefectOfParts(motion, x, nullptr, 0.3, 0.17), 1e-14);
  // Independent formulas: the covariance of a triple integrator that white noise drives, or the
  // effect of a constant jerk j: (dt^3/6, dt^2/2, dt) j.
  Eigen::MatrixXd f = Eigen::MatrixXd::Zero(3 * D, 3 * D), q = f, jerk(3 * D, D);
  jerk.setZero();
  for (int i = 0; i < D; ++i) {
    f(i, D + i) = f(D + i, 2 * D + i) = 1.0;
    q(2 * D + i, 2 * D + i) = sigma * sigma;
    jerk(i, i) = dt_s * dt_s * dt_s / 6.0;
    jerk(D + i, i) = dt_s * dt_s / 2.0;
    jerk(2 * D + i, i) = dt_s;
  }
  const Eigen::MatrixXd expected = kContinuous
                                       ? testing::IntegratedNoise(f, q, dt_s)
                                       : Eigen::MatrixXd(sigma * sigma * jerk * jerk.transpose());
  testing::ExpectSameCovariance(testing::NoiseOfSteps(motion, x, nullptr, dt_s, 1), expected, 1e-9);
}

TEST(ConstantAcceleration, SpreadsAsItsEquationsSay) {
  CheckConstantAcceleration<1, false>();
  CheckConstantAcceleration<2, false>();
  CheckConstantAcceleration<3, false>();
  CheckConstantAcceleration<1, true>();
  CheckConstantAcceleration<2, true>();
  CheckConstantAcceleration<3, true>();
}

TEST(ConstantAcceleration, Moves) {
  // A car brakes from 20 m/s at 4 m/s^2 and stops after 5 s and 50 m.
  const auto motion = AbiMotion<ConstantAcceleration<1, true>>({{"noise.jerk", {0}}});
  const Blocks next = StepWithJacobians(motion, {{7}, {20}, {-4}}, nullptr, nullptr, 5.0).next;
  EXPECT_NEAR(next[0][0], 57, 1e-13);
  EXPECT_NEAR(next[1][0], 0, 1e-13);
  EXPECT_EQ(next[2][0], -4);
}

}  // namespace
}  // namespace alidade
