// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/observability.h"

#include <gtest/gtest.h>

#include "support/driven.h"
#include "support/landmark_models.h"
#include "support/systems.h"

namespace alidade {
namespace {

using Names = std::vector<std::string>;

TEST(UnobservableDirections, StereoAndScaleTellEverything) {
  EXPECT_TRUE(UnobservableDirections(testing::DepthFilter()).empty());
}

TEST(UnobservableDirections, ScaleAloneCannotTellLambdaFromDepth) {
  Problem problem = testing::DepthFilter();
  problem.sensors.erase(problem.sensors.begin());
  const auto directions = UnobservableDirections(problem);
  ASSERT_EQ(directions.size(), 1u);
  EXPECT_EQ(directions[0],
            (Names{"target.depth", "target.depth_rate", "template.inverse_distance"}));
}

TEST(UnobservableDirections, StereoAloneSaysNothingOfLambda) {
  Problem problem = testing::DepthFilter();
  problem.sensors.pop_back();
  const auto directions = UnobservableDirections(problem);
  ASSERT_EQ(directions.size(), 1u);
  EXPECT_EQ(directions[0], Names{"template.inverse_distance"});
}

TEST(UnobservableDirections, AHeldBlockIsNotEstimated) {
  Problem problem = testing::DepthFilter();
  problem.sensors[1].roles[1].mode = RoleMode::kKnown;
  const auto directions = UnobservableDirections(problem);
  ASSERT_EQ(directions.size(), 1u);
  EXPECT_EQ(directions[0], Names{"template.inverse_distance"});
}

TEST(UnobservableDirections, AreUnknownIfASensorIsNotDefinedAtThePrior) {
  Problem problem = testing::DepthFilter();
  for (Prior& prior : problem.priors) {
    if (problem.layout[prior.block].name == "target.depth") prior.mean = {-0.3};
  }
  EXPECT_TRUE(UnobservableDirections(problem).empty());
}

/// Measures a position, with a lever arm if the role is bound.
struct WithLeverArm : Sensor<Vec<3>, Vec<3>, Vec<3>> {
  static constexpr std::array kRoles{Quantity{"position"},
                                     Quantity{"lever_arm", "", "", "", ALIDADE_ROLE_OPTIONAL}};
  static constexpr Quantity kMeasurement{"z"};
  template <class T>
  bool Predict(const T* position, const T* lever_arm, T* z) const {
    for (int i = 0; i < 3; ++i) z[i] = position[i] + (lever_arm == nullptr ? T(0.0) : lever_arm[i]);
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, T* l) const {
    for (int i = 0; i < 3; ++i) l[4 * i] = T(0.1);
  }
};

// The model writes a Jacobian with three columns for each role that has a destination.
TEST(UnobservableDirections, DoNotNeedTheJacobianOfAnUnboundRole) {
  Problem problem;
  MotionBinding binding{"p", testing::ConstantMotion(3), {}};
  binding.blocks.push_back(problem.layout.Declare("p.x", "p", binding.model->blocks()[0]));
  problem.priors.push_back({0, {1.0, 2.0, 3.0}, Eigen::Matrix3d::Identity(), ""});
  problem.motions.push_back(binding);
  testing::AddSensor(problem, "s", MakeSensor(WithLeverArm{}, "with_lever_arm"), {"p.x"});
  problem.sensors[0].roles.push_back({});
  EXPECT_TRUE(UnobservableDirections(problem).empty());
}

TEST(UnobservableDirections, WhereNothingMeasuresNothingIsSeen) {
  Problem problem = testing::DepthFilter();
  problem.sensors.clear();
  EXPECT_EQ(
      UnobservableDirections(problem),
      (std::vector<Names>{{"target.depth"}, {"target.depth_rate"}, {"template.inverse_distance"}}));
}

TEST(UnobservableDirections, ManyBlocksThatNothingJoinsAreToldApart) {
  constexpr int kPairs = 150;
  Problem problem;
  for (int i = 0; i < kPairs; ++i) {
    const std::string name = "p" + std::to_string(i);
    testing::AddMotion(problem, name, testing::ConstantVelocityMotion(1.0),
                       {{"x", 1.0, 1e-3}, {"v", 0.0, 1e3}});
    if (i % 50 == 7) continue;
    testing::AddSensor(problem, name, testing::LinearSensor(1.0, 1.0), {name + ".x"});
  }
  EXPECT_EQ(UnobservableDirections(problem),
            (std::vector<Names>{{"p7.x"}, {"p7.v"}, {"p57.x"}, {"p57.v"}, {"p107.x"}, {"p107.v"}}));
}

TEST(UnobservableDirections, AreNotLookedForInALargeState) {
  const auto state_of = [](int size) {
    Problem problem;
    const SharedMotion model = testing::ConstantMotion(size);
    const BlockId id = problem.layout.Declare("c.value", "c", model->blocks()[0]);
    problem.motions.push_back({"c", model, {id}});
    Prior prior;
    prior.block = id;
    prior.mean.assign(static_cast<std::size_t>(size), 0.0);
    prior.covariance = Eigen::MatrixXd::Identity(size, size);
    problem.priors.push_back(prior);
    return problem;
  };
  EXPECT_EQ(UnobservableDirections(state_of(500)).size(), 500u);
  EXPECT_TRUE(UnobservableDirections(state_of(501)).empty());
}

// Tests fault 78 of tests/faults/README.md: a single camera without other motion or sensor
// information cannot determine the scale of the world.
TEST(UnobservableDirections, OneCameraCannotTellScale) {
  const auto problem = [](const LandmarkOptions& options) {
    return testing::MapSystem(testing::InverseDepthPixels(0.01), options);
  };
  EXPECT_EQ(UnobservableDirections(problem(testing::WithPrior())), (std::vector<Names>{{"scale"}}));
  const auto anchored =
      testing::MapSystem(testing::AnchoredPixels<ALIDADE_ROLE_SHARED>(0.01), testing::WithPrior());
  EXPECT_EQ(UnobservableDirections(anchored), (std::vector<Names>{{"scale"}}));
  // A single landmark with a known position determines the scale.
  LandmarkOptions known = testing::WithPrior();
  known.known = {{1, {0.0, 0.0, 2.0}, 0.01}};
  EXPECT_TRUE(UnobservableDirections(problem(known)).empty());
  // Any offset that is measured in metres also determines the scale.
  EXPECT_TRUE(UnobservableDirections(testing::MapSystem(testing::Offset(0.1), {})).empty());
}

// Tests fault 78 of tests/faults/README.md: the initial position of the camera is also unknown, so
// a shift of the whole world is unobservable.
TEST(UnobservableDirections, WithoutAFirstPositionTheWorldIsAnywhere) {
  const Problem problem =
      testing::MapSystem(testing::InverseDepthPixels(0.01), testing::WithPrior(), 0.5);
  const auto directions = UnobservableDirections(problem);
  ASSERT_EQ(directions.size(), 4u);
  EXPECT_EQ(directions[0], Names{"scale"});
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(directions[i + 1], (Names{std::string("cam.position.") + "xyz"[i], "landmarks"}));
  }
}

/// Adds a block with the prior mean `mean`. Each tangent element has the standard deviation
/// `sigma`.
BlockId AddBlock(Problem& problem, const std::string& name, const Space& space,
                 const std::vector<double>& mean, double sigma) {
  const BlockId id = problem.layout.Declare(name, name.substr(0, name.find('.')), space);
  const int n = space.geometry.tangent;
  problem.priors.push_back({id, mean, sigma * sigma * Eigen::MatrixXd::Identity(n, n), {}});
  return id;
}

/// Returns a body `b` driven by its accelerometer. A sensor measures the block `measured`, which is
/// the position or the velocity of the body.
Problem Accelerated(const std::string& measured) {
  Problem problem;
  const SharedMotion model = MakeMotion(testing::Accelerated(), "accelerated");
  const BlockId p = AddBlock(problem, "b.position", model->blocks()[0], {0.0, 0.0, 0.0}, 1.0);
  const BlockId v = AddBlock(problem, "b.velocity", model->blocks()[1], {0.0, 0.0, 0.0}, 1.0);
  const BlockId q = AddBlock(problem, "b.orientation", model->blocks()[2], {1, 0, 0, 0}, 0.2);
  problem.motions.push_back({"b", model, {p, v, q}, {"accelerometer"}});
  testing::AddSensor(problem, "fix", MakeSensor(testing::Position3(), "position"), {measured});
  return problem;
}

// The rotation about the direction of the acceleration becomes observable when this direction
// changes.
TEST(UnobservableDirections, AnAccelerometerThatChangesAndAPositionTellTheOrientation) {
  EXPECT_EQ(UnobservableDirections(Accelerated("b.position")), std::vector<Names>{});
}

// If the acceleration u is constant, only R u is observable. So one of the three rotations is
// unobservable.
TEST(UnobservableDirections, AConstantAccelerometerLeavesARotation) {
  using internal::Excitation;
  const Problem problem = Accelerated("b.position");
  EXPECT_EQ(internal::UnobservableDirections(problem, Excitation::kConstant),
            (std::vector<Names>{{"b.orientation"}}));
}

TEST(UnobservableDirections, WhatNoInputExcitesIsReported) {
  EXPECT_EQ(UnobservableDirections(Accelerated("b.velocity")),
            (std::vector<Names>{{"b.position.x"}, {"b.position.y"}, {"b.position.z"}}));
}

/// Returns a vehicle `car` driven by its odometry. A satellite receiver is on a mast of the
/// vehicle.
Problem CarWithMast() {
  Problem problem;
  const SharedMotion model = MakeMotion(testing::Unicycle(), "unicycle");
  const BlockId p = AddBlock(problem, "car.position", model->blocks()[0], {0.0, 0.0}, 1.0);
  const BlockId heading = AddBlock(problem, "car.heading", model->blocks()[1], {0.3}, 0.2);
  const BlockId mast = AddBlock(problem, "car.mast", model->blocks()[2], {0.5, 0.1}, 0.5);
  problem.motions.push_back({"car", model, {p, heading, mast}, {"odometry"}});
  testing::AddSensor(problem, "fix", MakeSensor(testing::OnMast(), "on_mast"),
                     {"car.position", "car.heading", "car.mast"});
  return problem;
}

// If the odometry were constant, the receiver would move on a circle. The centre, the radius and
// the phase of this circle are 4 numbers, too few for the 5 unknowns.
TEST(UnobservableDirections, OdometryThatChangesTellsALeverArm) {
  EXPECT_EQ(UnobservableDirections(CarWithMast()), std::vector<Names>{});
}

/// Motion model with four blocks. Each block is the derivative of the previous one.
struct Chain : Motion<1, Vec<1>, Vec<1>, Vec<1>, Vec<1>> {
  static constexpr std::array kBlocks{Quantity{"x"}, Quantity{"v"}, Quantity{"a"}, Quantity{"j"}};
  template <class T>
  void Step(const T* x, const T* v, const T* a, const T* j, const T* w, double dt_s, T* x1, T* v1,
            T* a1, T* j1) const {
    x1[0] = x[0] + v[0] * dt_s;
    v1[0] = v[0] + a[0] * dt_s;
    a1[0] = a[0] + j[0] * dt_s;
    j1[0] = j[0] + w[0];
  }
  void SqrtQ(double, MatrixRef l) const { l(0, 0) = 1.0; }
};

// In three steps of 0.02 s the jerk j moves x by j (0.02 s)^3. If j has sigma 0.01 m/s^3 and the
// position 1 m, this shift is 8e-8 sigma of the position: small, but above rounding.
TEST(UnobservableDirections, AThirdDerivativeIsSeen) {
  Problem problem;
  testing::AddMotion(problem, "p", MakeMotion(Chain(), "chain"),
                     {{"x", 0.0, 1.0}, {"v", 0.0, 1.0}, {"a", 0.0, 1.0}, {"j", 0.0, 0.01}});
  testing::AddSensor(problem, "fix", testing::LinearSensor(1.0, 1.0), {"p.x"});
  EXPECT_EQ(UnobservableDirections(problem), std::vector<Names>{});
}

}  // namespace
}  // namespace alidade
