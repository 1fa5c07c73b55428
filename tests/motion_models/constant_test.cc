// SPDX-License-Identifier: Apache-2.0
#include "motion_models/constant.h"

#include <gtest/gtest.h>

#include "support/model_checks.h"
#include "support/model_maker.h"

namespace alidade {
namespace {

using testing::AbiMotion;
using testing::Blocks;
using testing::Covariance;
using testing::ExpectSame;
using testing::ExpectTrueJacobians;
using testing::StepResult;
using testing::StepWithJacobians;

TEST(Constant, StaysAndHasNoNoise) {
  const auto constant = AbiMotion<Constant<>>();
  EXPECT_EQ(constant->noise_size(), 0);
  const StepResult out = StepWithJacobians(constant, {{3.3}}, nullptr, nullptr, 0.1);
  EXPECT_EQ(out.next[0][0], 3.3);
  EXPECT_EQ(out.f[0], 1.0);
}

TEST(Constant, WalksWithTheRootOfTime) {
  const auto walk = AbiMotion<Constant<>>({{"size", {3}}, {"noise.random_walk", {0.2}}});
  ASSERT_EQ(walk->noise_size(), 3);
  EXPECT_EQ(walk->blocks()[0].elements, (std::vector<std::string>{"0", "1", "2"}));
  const Blocks x{{1, 2, 3}};
  EXPECT_EQ(StepWithJacobians(walk, x, nullptr, nullptr, 0.25).next, x)
      << "without a noise argument the noise is zero";
  ExpectTrueJacobians(walk, x, nullptr, {0.1, -0.2, 0.3}, 0.25);
  // The variance is 0.2^2 * 0.25 = 0.01.
  ExpectSame(Covariance(walk, x, 0.25), {0.01, 0, 0, 0, 0.01, 0, 0, 0, 0.01}, 1e-15);
}

}  // namespace
}  // namespace alidade
