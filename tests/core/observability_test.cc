// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "support/landmark_models.h"
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

TEST(UnobservableDirections, WhereNothingMeasuresNothingIsSeen) {
  System system = testing::DepthFilter();
  system.sensors.clear();
  EXPECT_EQ(
      UnobservableDirections(system),
      (std::vector<Names>{{"target.depth"}, {"target.depth_rate"}, {"template.inverse_distance"}}));
}

TEST(UnobservableDirections, ManyBlocksThatNothingJoinsAreToldApart) {
  constexpr int kPairs = 150;
  System system;
  for (int i = 0; i < kPairs; ++i) {
    const std::string name = "p" + std::to_string(i);
    testing::AddMotion(system, name,
                       InProcessMotion(ConstantVelocity<1, false>(1.0), "constant_velocity"),
                       {{"x", 1.0, 1e-3}, {"v", 0.0, 1e3}});
    if (i % 50 == 7) continue;
    testing::AddSensor(system, name, InProcessSensor(testing::Linear(1.0, 1.0), "linear"),
                       {name + ".x"});
  }
  EXPECT_EQ(UnobservableDirections(system),
            (std::vector<Names>{{"p7.x"}, {"p7.v"}, {"p57.x"}, {"p57.v"}, {"p107.x"}, {"p107.v"}}));
}

TEST(UnobservableDirections, AreNotLookedForInALargeState) {
  const auto state_of = [](int size) {
    System system;
    const MotionModel model = InProcessMotion(Constant<>(size), "constant");
    const BlockId id = system.layout.Declare("c.value", "c", model.blocks()[0]);
    system.motions.push_back({"c", model, {id}});
    Prior prior;
    prior.block = id;
    prior.mean.assign(static_cast<std::size_t>(size), 0.0);
    prior.covariance = Eigen::MatrixXd::Identity(size, size);
    system.priors.push_back(prior);
    return system;
  };
  EXPECT_EQ(UnobservableDirections(state_of(500)).size(), 500u);
  EXPECT_TRUE(UnobservableDirections(state_of(501)).empty());
}

// FAULTS 78: one camera that nothing else moves or measures cannot tell how large the world is.
TEST(UnobservableDirections, OneCameraCannotTellScale) {
  const auto system = [](const LandmarkOptions& options) {
    return testing::MapSystem(testing::InverseDepthPixels(0.01), options);
  };
  EXPECT_EQ(UnobservableDirections(system(testing::WithPrior())), (std::vector<Names>{{"scale"}}));
  const auto anchored =
      testing::MapSystem(testing::AnchoredPixels<ALIDADE_ROLE_SHARED>(0.01), testing::WithPrior());
  EXPECT_EQ(UnobservableDirections(anchored), (std::vector<Names>{{"scale"}}));
  // One landmark whose place is known is a scale.
  LandmarkOptions known = testing::WithPrior();
  known.known = {{1, {0.0, 0.0, 2.0}, 0.01}};
  EXPECT_TRUE(UnobservableDirections(system(known)).empty());
  // So is any offset in metres.
  EXPECT_TRUE(UnobservableDirections(testing::MapSystem(testing::Offset(0.1), {})).empty());
}

// FAULTS 78: where the camera starts is not known either: the whole world may be elsewhere.
TEST(UnobservableDirections, WithoutAFirstPositionTheWorldIsAnywhere) {
  const System system =
      testing::MapSystem(testing::InverseDepthPixels(0.01), testing::WithPrior(), 0.5);
  const auto directions = UnobservableDirections(system);
  ASSERT_EQ(directions.size(), 4u);
  EXPECT_EQ(directions[0], Names{"scale"});
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(directions[i + 1], (Names{std::string("cam.position.") + "xyz"[i], "landmarks"}));
  }
}

}  // namespace
}  // namespace alidade
