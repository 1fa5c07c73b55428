// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "support/systems.h"

namespace alidade {
namespace {

using Names = std::vector<std::string>;

TEST(UnobservableDirections, StereoAndScaleTellEverything) {
  EXPECT_TRUE(UnobservableDirections(testing::DepthFilter()).empty());
}

TEST(UnobservableDirections, ScaleAloneCannotTellLambdaFromDepth) {
  System system = testing::DepthFilter();
  system.sensors.erase(system.sensors.begin());
  const auto directions = UnobservableDirections(system);
  ASSERT_EQ(directions.size(), 1u);
  EXPECT_EQ(directions[0],
            (Names{"target.depth", "target.depth_rate", "template.inverse_distance"}));
}

TEST(UnobservableDirections, StereoAloneSaysNothingOfLambda) {
  System system = testing::DepthFilter();
  system.sensors.pop_back();
  const auto directions = UnobservableDirections(system);
  ASSERT_EQ(directions.size(), 1u);
  EXPECT_EQ(directions[0], Names{"template.inverse_distance"});
}

TEST(UnobservableDirections, AHeldBlockIsNotEstimated) {
  System system = testing::DepthFilter();
  system.sensors[1].roles[1].mode = RoleMode::kHold;
  const auto directions = UnobservableDirections(system);
  ASSERT_EQ(directions.size(), 1u);
  EXPECT_EQ(directions[0], Names{"template.inverse_distance"});
}

}  // namespace
}  // namespace alidade
