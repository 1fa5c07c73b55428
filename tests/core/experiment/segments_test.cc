// SPDX-License-Identifier: Apache-2.0
//
// Compares the metrics of segments with errors that an observer collects, and tests their keys.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <utility>

#include "alidade/experiment/run.h"
#include "support/config_text.h"

namespace alidade {
namespace {

using testing::Message;

std::string WithSegments(const std::string& segments) {
  return R"(alidade: 1
state:
  target: {model: constant_velocity, blocks: {position: depth, velocity: depth_rate},
           noise: {kind: discrete, acceleration: 1},
           initial: {depth: {mean: 0.3, sigma: 0.1}, depth_rate: {sigma: 0.5}}}
sensors:
  stereo: {model: stereo_disparity, stream: disparity, roles: {depth: target.depth},
           focal_px: 400, baseline_m: 0.065, sigma_px: 1}
source: {type: depth_target, seed: 1}
estimators: [ekf]
evaluate: {segments: {part: )" +
         segments + "}}\n";
}

/// Root mean square of the errors of the position at the frames that `contains` selects.
class ErrorCollector : public RunObserver {
 public:
  using Contains = std::function<bool(double t_s, bool has_disparity)>;
  explicit ErrorCollector(Contains contains) : contains_(std::move(contains)) {}

  void OnEstimate(int, const SourceFrame& frame, const State& state, const UpdateReport&) override {
    const auto is_disparity = [](const Measurement& m) { return m.stream == 0; };
    const bool has_disparity = std::ranges::any_of(frame.measurements, is_disparity);
    if (!contains_(Seconds(frame.timestamp), has_disparity) || frame.truth.empty()) return;
    const double error = frame.truth[0][0] - state.value(0)[0];
    sum_ += error * error;
    ++count_;
  }
  int count() const { return count_; }
  double rmse() const { return std::sqrt(sum_ / count_); }

 private:
  Contains contains_;
  double sum_ = 0.0;
  int count_ = 0;
};

struct SegmentCase {
  const char* segment;
  ErrorCollector::Contains contains;
};

TEST(Segments, ContainTheFramesOfTheirConditions) {
  const PluginHost host;
  const SegmentCase cases[] = {
      {"{from_s: 1, to_s: 2}", [](double t, bool) { return t >= 1.0 && t <= 2.0; }},
      {"{from_s: 1.5}", [](double t, bool) { return t >= 1.5; }},
      {"{to_s: 1.5}", [](double t, bool) { return t <= 1.5; }},
      {"{without: stereo, from_s: 1}", [](double t, bool with) { return !with && t >= 1.0; }},
      {"{with: stereo, to_s: 2}", [](double t, bool with) { return with && t <= 2.0; }}};
  for (const SegmentCase& c : cases) {
    Experiment experiment =
        BuildExperiment(Config::FromText(WithSegments(c.segment), "f.yaml"), host);
    ASSERT_EQ(experiment.source->streams()[0].name, "disparity");
    ErrorCollector errors(c.contains);
    RunOptions options;
    options.observers = {&errors};
    const RunResult result = alidade::Run(experiment, options);
    ASSERT_EQ(result.status, RunStatus::kOk) << result.reason;
    const auto& metrics = result.estimators[0].metrics;
    ASSERT_GT(errors.count(), 5) << c.segment;
    ASSERT_EQ(metrics.count("rmse:target.depth@part"), 1U) << c.segment;
    EXPECT_NEAR(metrics.at("rmse:target.depth@part"), errors.rmse(), 1e-12) << c.segment;
    EXPECT_NE(metrics.at("rmse:target.depth@part"), metrics.at("rmse:target.depth")) << c.segment;
  }
}

TEST(Segments, ErrorsNameTheConditions) {
  const PluginHost host;
  const auto error = [&](const std::string& segment) {
    return Message(
        [&] { BuildExperiment(Config::FromText(WithSegments(segment), "f.yaml"), host); });
  };
  EXPECT_EQ(error("{}"),
            "f.yaml:11:29 evaluate.segments.part: a segment needs a condition; expected `with: "
            "SENSOR` or `without: SENSOR`, or `from_s` and `to_s`, times in s");
  EXPECT_EQ(error("{with: stereo, without: stereo}"),
            "f.yaml:11:29 evaluate.segments.part: a segment cannot have `with` and `without`; "
            "expected `with: SENSOR` or `without: SENSOR`, or `from_s` and `to_s`, times in s");
  EXPECT_EQ(error("{from_s: 2, to_s: 1}"),
            "f.yaml:11:47 evaluate.segments.part.to_s: the segment ends before it begins; expected "
            "at least from_s");
  EXPECT_EQ(error("{from: 2}"),
            "f.yaml:11:30 evaluate.segments.part.from: unknown key; did you mean 'from_s'?");
}

}  // namespace
}  // namespace alidade
