// SPDX-License-Identifier: Apache-2.0
#include "motion_models/quaternion_pose.h"

#include <gtest/gtest.h>

#include "support/model_checks.h"
#include "support/model_maker.h"

namespace alidade {
namespace {

using testing::Blocks;
using testing::MakeMotion;
using testing::MapHost;
using testing::Stepped;

const MapHost::Values kNoise{{"noise.linear_acceleration", {0.6}},
                             {"noise.angular_acceleration", {0.1, 0.2, 0.3}}};

TEST(QuaternionPose, MovesAndTurnsByWorkedNumbers) {
  // Half a turn per second about z, 1 s; a = (0, 2, 0) m/s^2: v' = (1, 2, 0), r' = (1, 2, 3)
  const double pi = 3.14159265358979323846;
  const Blocks x{{0, 0, 3}, {1, 0, 0, 0}, {1, 0, 0}, {0, 0, pi / 2}};
  const double w[6] = {0, 2, 0, 0, 0, pi / 2};
  const Stepped out = testing::Step(MakeMotion<QuaternionPose>(kNoise), x, nullptr, w, 1.0);
  EXPECT_EQ(out.next[0], (std::vector<double>{1, 2, 3}));
  EXPECT_EQ(out.next[2], (std::vector<double>{1, 2, 0}));
  EXPECT_EQ(out.next[3], (std::vector<double>{0, 0, pi}));
  const double q[4] = {0, 0, 0, 1};  // a half turn
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(out.next[1][i], q[i], 1e-15);
}

TEST(QuaternionPose, HasTrueJacobiansAlsoWithoutTurning) {
  const MotionModel motion = MakeMotion<QuaternionPose>(kNoise);
  const std::vector<double> w{0.3, -0.2, 0.5, 0.4, 0.1, -0.6}, none(6);
  const Blocks moving{{1, 2, 3}, {0.8, 0.2, -0.4, 0.4}, {0.5, -1, 0.2}, {0.7, -0.4, 1.1}};
  Blocks still = moving;
  still[3] = {0, 0, 0};
  testing::ExpectTrueJacobians(motion, moving, nullptr, w, 0.2);
  testing::ExpectTrueJacobians(motion, still, nullptr, none, 0.2);
  // d rotation / d omega = dt at omega = 0, exact
  const Stepped out = testing::Step(motion, still, nullptr, none.data(), 0.2);
  for (int i = 0; i < 3; ++i) EXPECT_DOUBLE_EQ(out.f[(3 + i) * 12 + 9 + i], 0.2);
}

TEST(QuaternionPose, NoiseIsOneNumberOrOneForEachAxis) {
  const MotionModel motion = MakeMotion<QuaternionPose>(kNoise);
  const Blocks x{{1, 2, 3}, {1, 0, 0, 0}, {0, 0, 0}, {0, 0, 0}};
  const std::vector<double> q = testing::Covariance(motion, x, 0.1);
  const double expected[6] = {0.36, 0.36, 0.36, 0.01, 0.04, 0.09};
  for (int r = 0; r < 6; ++r) {
    for (int c = 0; c < 6; ++c) EXPECT_NEAR(q[r * 6 + c], r == c ? expected[r] : 0.0, 1e-16);
  }
  for (const std::vector<double>& bad :
       {std::vector<double>{1, 2}, {1, 2, 3, 4}, {1, 2, 3, 4, 5}}) {
    const MapHost host({{"noise.linear_acceleration", bad}, {"noise.angular_acceleration", {1}}});
    static_cast<void>(testing::MakeInstance(&EmplaceMotion<QuaternionPose>, host));
    ASSERT_EQ(host.failures().size(), 1u) << bad.size();
    EXPECT_EQ(host.failures()[0],
              "noise.linear_acceleration: needs one number, or one for each axis");
  }
}

}  // namespace
}  // namespace alidade
