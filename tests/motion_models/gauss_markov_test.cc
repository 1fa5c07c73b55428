// SPDX-License-Identifier: Apache-2.0
#include "motion_models/gauss_markov.h"

#include <gtest/gtest.h>

#include "support/integration.h"
#include "support/model_maker.h"

namespace alidade {
namespace {

using testing::AbiMotion;
using testing::StepWithJacobians;

TEST(GaussMarkov, ReturnsToZeroWithItsTimeConstant) {
  const auto motion =
      AbiMotion<GaussMarkov<>>({{"size", {2}}, {"time_constant_s", {3}}, {"noise.sigma", {0.5}}});
  ASSERT_EQ(motion->noise_size(), 2);
  EXPECT_FALSE(motion->discrete_noise());
  // After 3 s, exp(-1) = 0.367879441171442 of the value remains.
  const auto out = StepWithJacobians(motion, {{2, -1}}, nullptr, nullptr, 3.0);
  EXPECT_NEAR(out.next[0][0], 0.735758882342885, 1e-15);
  EXPECT_NEAR(out.next[0][1], -0.367879441171442, 1e-15);
  testing::ExpectTrueJacobians(motion, {{2, -1}}, nullptr, {0.3, -0.4}, 0.7);
  testing::ExpectAdditive(motion, {{2, -1}}, nullptr, 0.3, 1.9);
}

TEST(GaussMarkov, HasAStationaryVariance) {
  const auto motion = AbiMotion<GaussMarkov<>>({{"time_constant_s", {3}}, {"noise.sigma", {0.5}}});
  for (const double dt_s : {1e-6, 0.1, 2.0, 50.0}) {
    // The variance sigma^2 = 0.25 of the value at the start decays by a^2, and Q replaces the rest.
    const double a = StepWithJacobians(motion, {{1}}, nullptr, nullptr, dt_s).f[0];
    EXPECT_NEAR(a * a * 0.25 + testing::Covariance(motion, {{1}}, dt_s)[0], 0.25, 1e-15);
    // Independent formula: dx/dt = -x / tau + white noise of the density 2 sigma^2 / tau.
    const Eigen::MatrixXd f = Eigen::MatrixXd::Constant(1, 1, -1.0 / 3.0),
                          q = Eigen::MatrixXd::Constant(1, 1, 2.0 * 0.25 / 3.0);
    testing::ExpectSameCovariance(testing::NoiseOfSteps(motion, {{1}}, nullptr, dt_s, 1),
                                  testing::IntegratedNoise(f, q, dt_s), 1e-9);
  }
  EXPECT_LT(testing::DefectOfParts(motion, {{1}}, nullptr, 0.3, 1.7), 1e-14);
}

}  // namespace
}  // namespace alidade
