// SPDX-License-Identifier: Apache-2.0
//
// Tests problems without a noise input. These problems have neither an uncertain prior nor process
// noise, so there is nothing to solve for.
#include <cmath>

#include "alidade/experiment/estimator_plugin.h"
#include "batch_fixture.h"
#include "motion_models/constant.h"
#include "support/landmark_models.h"

namespace alidade {
namespace {

using testing::FrameAt;

constexpr double kScale = 2.0, kNoise = 0.3;

/// Returns the problem of a constant p.x that a linear sensor measures.
Problem ConstantSystem(BlockStatus status) {
  Problem problem;
  const SharedMotion still = MakeMotion(Constant<>(1), "constant");
  const BlockId id = problem.layout.Declare("p.x", "p", still->blocks()[0], status);
  problem.motions.push_back({"p", still, {id}});
  problem.priors.push_back({id, {1.5}, Eigen::MatrixXd::Zero(1, 1), ""});
  testing::AddSensor(problem, "z", testing::LinearSensor(kScale, kNoise), {"p.x"});
  return problem;
}
Problem StartsFromItsSensor() {
  Problem problem = ConstantSystem(BlockStatus::kEstimated);
  problem.priors[0].sensor = "z";
  return problem;
}

/// Estimates of all frames, from a filter or a smoother, and the texts of the events.
struct Estimated {
  std::vector<State> states;
  std::string said;
};

Estimated Estimate(const std::string& options, const Problem& problem,
                   const std::vector<Frame>& frames) {
  const Config config = Config::FromText("type: " + options + "\n", "estimator.yaml");
  const std::string type = config.root().At("type").Text();
  const auto estimator = CreateEstimator(testing::Shipped(), type, config.root())(
      problem, testing::StreamsOf(problem));
  Estimated result;
  const auto note = [&](const State& state, const UpdateReport& report) {
    result.states.push_back(state);
    for (const Event& event : report.events) result.said += event.text;
  };
  for (const Frame& frame : frames) {
    const UpdateReport& report = estimator->Process(frame);
    if (!estimator->offline()) note(estimator->state(), report);
  }
  if (estimator->offline()) {
    estimator->Smooth(
        [&](std::size_t, const State& state, const UpdateReport& report) { note(state, report); });
  }
  EXPECT_FALSE(estimator->failed()) << options << ": " << result.said;
  EXPECT_EQ(result.states.size(), frames.size()) << options;
  return result;
}

const std::vector<std::string> kAll = {"ceres_batch", "ceres_batch\nmode: filtering",
                                       "fixed_lag\nlag_s: 0.15",
                                       "fixed_lag\nlag_s: 0.15\noutput: lagged"};

// The value is the mean of z / gain over n measurements, with P = sigma^2 / (gain^2 n).
TEST(CeresBatchNoInputs, AFirstValueMayComeLate) {
  const std::vector<double> z = {3.1, 2.8, 3.3, 2.9};
  std::vector<Frame> frames = {FrameAt(0.0, {}), FrameAt(0.1, {})};
  for (const double one : z) {
    frames.push_back(FrameAt(0.1 * static_cast<double>(frames.size()), {{0, one}}));
  }
  for (const std::string& options : kAll) {
    SCOPED_TRACE(options);
    const std::vector<State> found = Estimate(options, StartsFromItsSensor(), frames).states;
    for (std::size_t k = 0; k < found.size(); ++k) {
      EXPECT_EQ(found[k].layout()[0].present, k >= 2) << k;
      EXPECT_EQ(found[k].layout()[0].has_covariance(), k >= 2) << k;
      EXPECT_EQ(found[k].covariance().size(), 1) << k;  // the block has a row from the start
    }
    EXPECT_NEAR(*found.back().value(0), 12.1 / 4.0 / kScale, 1e-9);
    EXPECT_NEAR(found.back().covariance().Variance(0), kNoise * kNoise / (kScale * kScale * 4.0),
                1e-9);
  }
}

// The motion model has noise, but the noise has no effect on constant blocks.
TEST(CeresBatchNoInputs, AllBlocksMayBeConstantThoughTheyMove) {
  const Problem problem = testing::WithStatus(testing::DepthFilter(), "", BlockStatus::kConstant);
  const std::vector<Frame> frames = {FrameAt(0.0, {{0, 80.0}}), FrameAt(0.1, {{0, 80.0}}),
                                     FrameAt(0.4, {{0, 80.0}}), FrameAt(0.5, {{0, 80.0}})};
  for (const std::string& options : kAll) {
    SCOPED_TRACE(options);
    const std::vector<State> found = Estimate(options, problem, frames).states;
    EXPECT_EQ(found.back().covariance().size(), 0);
    EXPECT_NEAR(*found.back().value(0), problem.priors[0].mean[0], 0.5);
  }
}

TEST(CeresBatchNoInputs, AFirstValueMayNeverCome) {
  const std::vector<Frame> frames = {FrameAt(0.0, {}), FrameAt(0.1, {}), FrameAt(0.4, {})};
  for (const std::string& options : kAll) {
    for (const State& state : Estimate(options, StartsFromItsSensor(), frames).states) {
      EXPECT_FALSE(state.layout()[0].present) << options;
    }
  }
}

// The three measurements only determine the cost: r = (z - 3) / 0.3 = 1, -2 and 4.
TEST(CeresBatchNoInputs, WhatIsFixedStaysAndHasItsCost) {
  const std::vector<Frame> frames = {FrameAt(0.0, {{0, 3.3}}), FrameAt(0.1, {{0, 2.4}}),
                                     FrameAt(0.3, {{0, 4.2}})};
  Problem problem = ConstantSystem(BlockStatus::kConstant);
  for (const std::string& options : kAll) {
    const Estimated found = Estimate(options, problem, frames);
    for (const State& state : found.states) EXPECT_EQ(*state.value(0), 1.5) << options;
    const bool tells = options == "ceres_batch";
    EXPECT_EQ(found.said, tells ? "cost 10.5, 0 iterations in 1 solve: converged" : "") << options;
  }
  problem.sensors[0].loss = {LossKind::kHuber, 1.0};  // rho = 0.5, 1.5 and 3.5
  EXPECT_EQ(Estimate("ceres_batch", problem, frames).said,
            "cost 5.5, 0 iterations in 1 solve: converged");
}

// The offsets are measured from a camera at rest. The estimate of each point is the mean of its
// offsets.
TEST(CeresBatchNoInputs, AFixedCameraHasAMap) {
  Problem problem = testing::MapSystem(testing::Offset(kNoise), {});
  problem.layout = {};
  problem.motions[0].model = MakeMotion(Constant<>(3), "constant");
  const Space place = problem.motions[0].model->blocks()[0];
  problem.layout.Declare("cam.position", "cam", place, BlockStatus::kConstant);
  std::vector<Frame> frames;
  for (int k = 0; k < 4; ++k) {
    frames.push_back(testing::FrameOf(0.1 * k, {{0, {1.0 + 0.1 * k, 2.0, 3.0}}}));
  }
  for (const std::string& options : {kAll[0], kAll[1]}) {
    SCOPED_TRACE(options);
    const Config config = Config::FromText("type: " + options + "\n", "estimator.yaml");
    const auto batch = CreateEstimator(testing::Shipped(), "ceres_batch", config.root())(
        problem, testing::StreamsOf(problem));
    for (const Frame& frame : frames) batch->Process(frame);
    if (batch->offline()) batch->Smooth([](std::size_t, const State&, const UpdateReport&) {});
    ASSERT_FALSE(batch->failed());
    const std::vector<LandmarkEstimate> map = batch->landmarks();
    ASSERT_EQ(map.size(), 1u);
    EXPECT_LT((map[0].position - Eigen::Vector3d(1.15, 2.0, 3.0)).norm(), 1e-9);
    const Eigen::Matrix3d expected = kNoise * kNoise / 4.0 * Eigen::Matrix3d::Identity();
    EXPECT_LT((map[0].covariance - expected).norm(), 1e-9);
  }
}

}  // namespace
}  // namespace alidade
