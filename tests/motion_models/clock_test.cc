// SPDX-License-Identifier: Apache-2.0
#include "motion_models/clock.h"

#include <gtest/gtest.h>

#include "support/integration.h"
#include "support/model_maker.h"

namespace alidade {
namespace {

using testing::AbiMotion;
using testing::Blocks;

TEST(Clock, DriftsAndSpreads) {
  const auto clock = AbiMotion<Clock<true>>({{"noise.bias", {0.3}}, {"noise.drift", {0.2}}});
  // A drift of 2 m/s adds 3 m in 1.5 s.
  const Blocks next = testing::StepWithJacobians(clock, {{10}, {2}}, nullptr, nullptr, 1.5).next;
  EXPECT_EQ(next[0][0], 13);
  EXPECT_EQ(next[1][0], 2);
  testing::ExpectTrueJacobians(clock, {{10}, {2}}, nullptr, {0.1, 0.2}, 1.5);
  EXPECT_LT(testing::DefectOfParts(clock, {{10}, {2}}, nullptr, 0.4, 1.3), 1e-14);
  Eigen::MatrixXd f(2, 2), q(2, 2);
  f << 0, 1, 0, 0;
  q << 0.09, 0, 0, 0.04;
  testing::ExpectSameCovariance(testing::NoiseOfSteps(clock, {{10}, {2}}, nullptr, 1.7, 1),
                                testing::IntegratedNoise(f, q, 1.7), 1e-9);
}

// Brown and Hwang: S_b = h_0 / 2 and S_d = 2 pi^2 h_-2, times c^2 in metres.
TEST(Clock, HasTheNoiseOfItsOscillator) {
  const testing::MapHost::Values quartz{
      {"noise_model", {1}}, {"h_0", {2e-19}}, {"h_minus_2", {2e-20}}};
  const auto seconds = AbiMotion<Clock<false>>(quartz), metres = AbiMotion<Clock<true>>(quartz);
  EXPECT_EQ(seconds->blocks()[0].unit, "s");
  EXPECT_EQ(metres->blocks()[0].unit, "m");
  const Eigen::MatrixXd q = testing::NoiseOfSteps(seconds, {{0}, {0}}, nullptr, 1.0, 1);
  EXPECT_NEAR(q(1, 1), 3.94784176e-19, 1e-27);  // 2 pi^2 2e-20
  EXPECT_NEAR(q(0, 0), 1e-19 + 3.94784176e-19 / 3, 1e-27);
  const Eigen::MatrixXd q_m = testing::NoiseOfSteps(metres, {{0}, {0}}, nullptr, 1.0, 1);
  testing::ExpectSameCovariance(q_m, 299792458.0 * 299792458.0 * q, 1e-14);
}

TEST(Clock, MayHaveNoNoise) {
  const auto clock = AbiMotion<Clock<false>>({{"noise.bias", {0}}, {"noise.drift", {0}}});
  EXPECT_EQ(testing::Covariance(clock, {{0}, {0}}, 1.0), (std::vector<double>{0, 0, 0, 0}));
  const auto white = AbiMotion<Clock<false>>({{"noise.bias", {2}}, {"noise.drift", {0}}});
  EXPECT_EQ(testing::Covariance(white, {{0}, {0}}, 1.0), (std::vector<double>{4, 0, 0, 0}));
}

}  // namespace
}  // namespace alidade
