// SPDX-License-Identifier: Apache-2.0
#include "motion_models/singer.h"

#include <gtest/gtest.h>

#include "motion_models/constant_acceleration.h"
#include "support/integration.h"
#include "support/model_maker.h"

namespace alidade {
namespace {

using testing::AbiMotion;
using testing::Blocks;

const Blocks kState{{1, 2}, {3, -4}, {-0.5, 0.6}};
const std::vector<double> kNoise{0.1, -0.2, 0.3, 0.2, -0.1, 0.4};

SharedMotion Make(double sigma, double tau_s) {
  return AbiMotion<Singer<2>>({{"noise.acceleration", {sigma}}, {"time_constant_s", {tau_s}}});
}

TEST(Singer, HasTheSolutionOfItsDifferentialEquation) {
  for (const double tau_s : {0.01, 2.0, 60.0}) {
    const SharedMotion motion = Make(0.8, tau_s);
    testing::ExpectTrueJacobians(motion, kState, nullptr, kNoise, 0.3);
    testing::ExpectAdditive(motion, kState, nullptr, 0.7, 0.4);
    Eigen::MatrixXd f = Eigen::MatrixXd::Zero(6, 6), q = f;
    for (int i = 0; i < 2; ++i) {
      f(i, 2 + i) = f(2 + i, 4 + i) = 1.0;
      f(4 + i, 4 + i) = -1.0 / tau_s;
      q(4 + i, 4 + i) = 2.0 * 0.8 * 0.8 / tau_s;
    }
    for (const double dt_s : {1e-3, 0.3, 1.9, 2.1}) {
      const auto step = testing::StepWithJacobians(motion, kState, nullptr, nullptr, dt_s);
      const Eigen::VectorXd x =
          Eigen::VectorXd::Map(std::vector<double>{1, 2, 3, -4, -0.5, 0.6}.data(), 6);
      const Eigen::VectorXd expected = testing::RungeKutta(
          x, dt_s, [&](const Eigen::VectorXd& y) { return Eigen::VectorXd(f * y); });
      for (int i = 0; i < 6; ++i) {
        EXPECT_NEAR(step.next[static_cast<std::size_t>(i / 2)][static_cast<std::size_t>(i % 2)],
                    expected[i], 1e-8);
      }
      testing::ExpectSameCovariance(testing::NoiseOfSteps(motion, kState, nullptr, dt_s, 1),
                                    testing::IntegratedNoise(f, q, dt_s), 1e-6);
    }
  }
}

// The power series (dt <= tau) and the closed form (dt > tau) agree at their border, and the
// division of dt into steps does not change Q.
TEST(Singer, QIsAccurateForEveryStep) {
  for (const double dt_s : {1e-6, 1e-3, 0.3, 1.0, 1.999999, 2.000001, 7.0, 100.0}) {
    EXPECT_LT(testing::DefectOfParts(Make(0.8, 2.0), kState, nullptr, 0.4 * dt_s, 0.6 * dt_s),
              1e-12)
        << dt_s;
  }
  const auto below = testing::NoiseOfSteps(Make(0.8, 2.0), kState, nullptr, 2.0, 1),
             above = testing::NoiseOfSteps(Make(0.8, 2.0), kState, nullptr, 2.0 + 1e-15, 1);
  testing::ExpectSameCovariance(below, above, 1e-12);
}

TEST(Singer, IsConstantAccelerationForALongTimeConstant) {
  const double sigma = 100.0, tau_s = 1e6, jerk = sigma * std::sqrt(2.0 / tau_s);
  const SharedMotion limit = AbiMotion<ConstantAcceleration<2, true>>({{"noise.jerk", {jerk}}});
  testing::ExpectSameCovariance(testing::NoiseOfSteps(Make(sigma, tau_s), kState, nullptr, 0.5, 1),
                                testing::NoiseOfSteps(limit, kState, nullptr, 0.5, 1), 1e-6);
}

}  // namespace
}  // namespace alidade
