// SPDX-License-Identifier: Apache-2.0
#include "motion_models/differential_drive.h"

#include <gtest/gtest.h>

#include "motion_models/unicycle.h"
#include "support/integration.h"
#include "support/model_maker.h"

namespace alidade {
namespace {

using testing::AbiMotion;
using testing::Blocks;
using testing::StepWithJacobians;

std::shared_ptr<const PluginMotion> Make(int kind = 0, std::vector<double> sigma = {0.2}) {
  return AbiMotion<DifferentialDrive>({{"noise.kind", {double(kind)}},
                                       {"noise.wheel_speed", std::move(sigma)},
                                       {"wheel_radius_m", {0.1}},
                                       {"track_width_m", {0.5}}});
}

Blocks At(double x, double y, double heading, double left = 0, double right = 0, double track = 0) {
  return {{x, y}, {heading}, {left}, {right}, {track}};
}

TEST(DifferentialDrive, IsAUnicycle) {
  // 10 and 15 rad/s on wheels of 0.1 m are 1 and 1.5 m/s: v = 1.25 m/s, omega = 0.5 m/s / 0.5 m.
  const double wheels[2] = {10, 15}, velocities[2] = {1.25, 1.0};
  const Blocks next = StepWithJacobians(Make(), At(1, 2, 3), wheels, nullptr, 0.7).next;
  const auto unicycle = AbiMotion<Unicycle>({{"noise.speed", {0}}, {"noise.turn_rate", {0}}});
  const Blocks expected = StepWithJacobians(unicycle, {{1, 2}, {3}}, velocities, nullptr, 0.7).next;
  EXPECT_NEAR(next[0][0], expected[0][0], 1e-14);
  EXPECT_NEAR(next[0][1], expected[0][1], 1e-14);
  EXPECT_NEAR(next[1][0], expected[1][0], 1e-14);
  for (std::size_t i = 2; i < 5; ++i) EXPECT_EQ(next[i][0], 0.0);
}

TEST(DifferentialDrive, ErrorsOfItsGeometryScaleTheWheels) {
  const double wheels[2] = {10, 15};
  // Errors of -10 %, 20 % and 25 %: v_l = 0.9, v_r = 1.8, track = 0.625 m.
  const Blocks next =
      StepWithJacobians(Make(), At(0, 0, 0, -0.1, 0.2, 0.25), wheels, nullptr, 0.5).next;
  const double turn = 0.9 * 0.5 / 0.625, way = 1.35 * 0.5;
  EXPECT_NEAR(next[1][0], turn, 1e-14);
  EXPECT_NEAR(next[0][0], way / turn * std::sin(turn), 1e-14);
  EXPECT_NEAR(next[0][1], way / turn * (1 - std::cos(turn)), 1e-14);
  EXPECT_EQ(next[3][0], 0.2);
  const auto motion = Make();
  testing::ExpectTrueJacobians(motion, At(1, 2, 3, -0.1, 0.2, 0.25), wheels, {0.3, -0.2}, 0.1);
  const double equal[2] = {10, 10};
  testing::ExpectTrueJacobians(motion, At(1, 2, 3), equal, {0, 0}, 0.1);
  testing::ExpectAdditive(motion, At(1, 2, 3, -0.1, 0.2, 0.25), wheels, 0.3, 0.8);
}

TEST(DifferentialDrive, NeedsAPositiveTrackWidth) {
  const double wheels[2] = {10, 15};
  const Blocks x = At(0, 0, 0, 0, 0, -1);
  Blocks next = testing::Filled(Make()->blocks(), testing::kPoison);
  const double none[2] = {};
  EXPECT_EQ(Make()->Step(testing::Pointers(x).data(), wheels, none, 0.1,
                         {testing::Pointers(next).data(), nullptr, nullptr}),
            Status::kOutOfDomain);
  EXPECT_EQ(next, testing::Filled(Make()->blocks(), testing::kPoison));
}

TEST(DifferentialDrive, NoiseIsPerWheel) {
  EXPECT_NEAR(testing::Covariance(Make(1, {0.2, 0.4}), At(0, 0, 0), 0.1)[3], 0.16, 1e-15);
  EXPECT_TRUE(Make(1)->discrete_noise());
  // White noise of both wheels, 0.2 rad/s^0.5 each: Var(x) = (0.1 * 0.2)^2 t / 2,
  // Var(h) = 2 (0.1 * 0.2 / 0.5)^2 t.
  const double straight[2] = {10, 10};
  const Eigen::MatrixXd q = testing::NoiseOfSteps(Make(), At(0, 0, 0), straight, 2.0, 500);
  EXPECT_NEAR(q(0, 0), 4e-4, 1e-12);
  EXPECT_NEAR(q(2, 2), 2 * 0.0016 * 2, 1e-12);
  EXPECT_LT(testing::DefectOfParts(Make(1), At(1, 2, 3), straight, 0.5e-3, 0.5e-3), 1e-3);
}

}  // namespace
}  // namespace alidade
