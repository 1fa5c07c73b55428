// SPDX-License-Identifier: Apache-2.0
#include "motion_models/bicycle.h"

#include <gtest/gtest.h>

#include "support/integration.h"
#include "support/model_maker.h"

namespace alidade {
namespace {

using testing::AbiMotion;
using testing::Blocks;
using testing::StepWithJacobians;

std::shared_ptr<const PluginMotion> Make(int kind = 0) {
  return AbiMotion<Bicycle>({{"noise.kind", {double(kind)}},
                             {"noise.speed", {0.3}},
                             {"noise.steering_angle", {0.02}},
                             {"wheelbase_m", {2.5}}});
}

TEST(Bicycle, TurnsOnTheRadiusOfItsSteeringAngle) {
  // tan(delta) = 0.5: the rear axle turns on a circle of 2.5 m / 0.5 = 5 m.
  const double u[2] = {2, std::atan(0.5)};
  const Blocks next = StepWithJacobians(Make(), {{0, 0}, {0}}, u, nullptr, 1.5).next;
  const double turn = 2 * 1.5 / 5;
  EXPECT_NEAR(next[0][0], 5 * std::sin(turn), 1e-14);
  EXPECT_NEAR(next[0][1], 5 * (1 - std::cos(turn)), 1e-14);
  EXPECT_NEAR(next[1][0], turn, 1e-14);
  const double straight[2] = {2, 0};
  for (const double* input : {u, straight}) {
    testing::ExpectTrueJacobians(Make(), {{1, 2}, {3}}, input, {0.3, -0.02}, 0.1);
    testing::ExpectAdditive(Make(), {{1, 2}, {3}}, input, 0.3, 0.8);
  }
}

TEST(Bicycle, NoiseIsThatOfTheInputs) {
  // The effect of w on the step is the derivative by the inputs: d phi / d delta = s / (L cos^2).
  const double u[2] = {2, 0.4}, dt_s = 0.1;
  const auto out = StepWithJacobians(Make(), {{1, 2}, {3}}, u, nullptr, dt_s);
  const double up[2] = {2, 0.4 + 1e-6}, down[2] = {2, 0.4 - 1e-6};
  const Blocks a = StepWithJacobians(Make(), {{1, 2}, {3}}, up, nullptr, dt_s).next,
               b = StepWithJacobians(Make(), {{1, 2}, {3}}, down, nullptr, dt_s).next;
  EXPECT_NEAR(out.g[1], (a[0][0] - b[0][0]) / 2e-6, 1e-9);
  EXPECT_NEAR(out.g[3], (a[0][1] - b[0][1]) / 2e-6, 1e-9);
  EXPECT_NEAR(out.g[5], 2 * dt_s / 2.5 / std::pow(std::cos(0.4), 2), 1e-14);
  EXPECT_NEAR(testing::Covariance(Make(0), {{1, 2}, {3}}, 0.1)[3], 0.0004 / 0.1, 1e-15);
  EXPECT_NEAR(testing::Covariance(Make(1), {{1, 2}, {3}}, 0.1)[3], 0.0004, 1e-15);
  for (const int kind : {0, 1}) {
    EXPECT_LT(testing::DefectOfParts(Make(kind), {{1, 2}, {3}}, u, 0.5e-3, 0.5e-3), 1e-3);
  }
}

TEST(Bicycle, NeedsASteeringAngleBelowARightAngle) {
  const Blocks x{{0, 0}, {0}};
  for (const double delta : {1.6, -1.6, 4.0}) {
    const double u[2] = {1, delta}, none[2] = {};
    Blocks next = testing::Filled(Make()->blocks(), testing::kPoison);
    EXPECT_EQ(Make()->Step(testing::Pointers(x).data(), u, none, 0.1,
                           {testing::Pointers(next).data(), nullptr, nullptr}),
              Status::kOutOfDomain);
  }
}

}  // namespace
}  // namespace alidade
