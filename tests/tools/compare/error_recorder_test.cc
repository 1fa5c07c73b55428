// SPDX-License-Identifier: Apache-2.0
#include "alidade/compare/error_recorder.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/recording.h"

namespace alidade {
namespace {

/// Passes the estimates of the first estimator to an ErrorRecorder.
class ShowsErrors : public RunObserver {
 public:
  explicit ShowsErrors(internal::ErrorRecorder& recorder) : recorder_(recorder) {}
  void OnEstimate(int estimator, const SourceFrame& frame, const State& state,
                  const UpdateReport&) override {
    if (estimator == 0) recorder_.Add(frame, state);
  }

 private:
  internal::ErrorRecorder& recorder_;
};

struct Followed {
  ErrorSeries series;
  RunResult result;
};

Followed Follow(int frames) {
  Experiment experiment = testing::MakeExperiment(frames);
  internal::ErrorRecorder recorder(experiment.estimators[0], experiment);
  ShowsErrors shows(recorder);
  RunOptions options;
  options.observers = {&shows};
  RunResult result = Run(experiment, options);
  return {recorder.Finish(), std::move(result)};
}

// The fourth frame has no truth, so it has no error.
TEST(ErrorRecorder, HasWhatTheMetricsAreTakenFrom) {
  const auto [series, result] = Follow(60);
  ASSERT_EQ(series.blocks, (std::vector<std::string>{"target.depth"}));
  ASSERT_EQ(series.timestamps.size(), 60u);
  double square = 0.0, nees = 0.0;
  for (std::size_t k = 0; k < 60; ++k) {
    EXPECT_EQ(std::isnan(series.squares[k]), k == 3);
    if (k == 3) continue;
    square += series.squares[k] / 59.0;
    nees += series.nees[k] / series.dofs[k] / 59.0;
  }
  const auto& metrics = result.estimators[0].metrics;
  EXPECT_NEAR(std::sqrt(square), metrics.at("rmse:target.depth"), 1e-15);
  EXPECT_NEAR(nees, metrics.at("nees.mean:target"), 1e-12);
}

// When 2048 rows are stored, every second row is removed: at frame 2047 and again at frame 4094.
// From then on only every fourth frame is recorded.
TEST(ErrorRecorder, KeepsOfALongRunEveryNthTimestamp) {
  const ErrorSeries all = Follow(1000).series, thinned = Follow(5000).series;
  ASSERT_EQ(thinned.timestamps.size(), 1250u);
  ASSERT_EQ(thinned.squares.size(), 1250u);
  ASSERT_EQ(thinned.nees.size(), 1250u);
  for (std::size_t k = 1; k < 250; ++k) {
    EXPECT_EQ(thinned.timestamps[k], all.timestamps[4 * k]);
    EXPECT_EQ(thinned.squares[k], all.squares[4 * k]);
    EXPECT_EQ(thinned.nees[k], all.nees[4 * k]);
  }
  EXPECT_NEAR(Seconds(thinned.timestamps.back()), 0.033 * 4996, 1e-6);
}

/// A source that also has the truth of lambda and of the depth rate.
class WithAllTruth : public testing::SwingingTarget {
 public:
  using SwingingTarget::SwingingTarget;
  const std::vector<StreamInfo>& truths() const override { return truths_; }
  bool Next(SourceFrame& frame) override {
    if (!SwingingTarget::Next(frame)) return false;
    const double t_s = Seconds(frame.timestamp);
    frame.truth = {
        {0.3 + 0.1 * std::sin(2.5133 * t_s)}, {0.25133 * std::cos(2.5133 * t_s)}, {1.0 / 0.3}};
    return true;
  }

 private:
  std::vector<StreamInfo> truths_ = {{"depth"}, {"depth_rate"}, {"inverse_distance"}};
};

ErrorSeries FollowWithAllTruth(int frames, EstimatorKind kind = EstimatorKind::kFilter) {
  Experiment experiment = testing::MakeExperiment(frames);
  experiment.source = std::make_unique<WithAllTruth>(frames);
  experiment.estimators[0].kind = kind;
  internal::ErrorRecorder recorder(experiment.estimators[0], experiment);
  ShowsErrors shows(recorder);
  RunOptions options;
  options.observers = {&shows};
  Run(experiment, options);
  return recorder.Finish();
}

TEST(ErrorRecorder, HasErrorsByTheirCramerRaoBound) {
  const ErrorSeries series = FollowWithAllTruth(60);
  ASSERT_EQ(series.blocks.size(), 3u);
  ASSERT_EQ(series.bounds.size(), series.squares.size());
  EXPECT_EQ(series.no_bound_reason, "");
  for (std::size_t i = 0; i < 3; ++i) {
    double sum = 0.0;
    for (std::size_t k = 0; k < 60; ++k) {
      sum += series.squares[3 * k + i] / series.bounds[3 * k + i];
    }
    EXPECT_NEAR(series.by_bound.at(series.blocks[i]), sum / 60.0, 1e-12);
  }
  // The first bound combines the prior with one measurement of each sensor.
  const double h = -26.0 / (0.3 * 0.3);
  EXPECT_LT(series.bounds[0], 1.0 / (h * h));
}

TEST(ErrorRecorder, ThinsTheBoundWithTheRest) {
  const ErrorSeries all = FollowWithAllTruth(1000), thinned = FollowWithAllTruth(5000);
  ASSERT_EQ(thinned.bounds.size(), thinned.squares.size());
  for (std::size_t k = 1; k < 250; ++k) EXPECT_EQ(thinned.bounds[3 * k], all.bounds[3 * 4 * k]);
}

TEST(ErrorRecorder, HasNoBoundOfWhatKnowsLaterDataOrWhereTruthLacks) {
  EXPECT_EQ(Follow(60).series.no_bound_reason, "'target.depth_rate' has no truth");
  const ErrorSeries window = FollowWithAllTruth(60, EstimatorKind::kSlidingWindow);
  EXPECT_TRUE(window.bounds.empty() && window.by_bound.empty() && window.no_bound_reason.empty());
}

}  // namespace
}  // namespace alidade
