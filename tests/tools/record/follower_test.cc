// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/follower.h"

#include <gtest/gtest.h>

#include "support/recording.h"

namespace alidade::testing {
namespace {

/// Returns the number that belongs to `key` in a line of JSON.
double NumberOf(const std::string& line, const std::string& key) {
  const std::size_t at = line.find('"' + key + "\":");
  if (at == std::string::npos) return std::nan("");
  return std::strtod(line.c_str() + at + key.size() + 3, nullptr);
}

TEST(Follower, WritesEachEstimateAsSoonAsItIsMade) {
  Experiment experiment = MakeExperiment(5);
  std::vector<std::string> lines;
  Follower follower([&](std::string_view line) { lines.emplace_back(line); });
  /// Checks the lines after each estimate. The run calls this observer after the follower.
  struct After : RunObserver {
    explicit After(const std::vector<std::string>& all) : lines(all) {}
    void OnEstimate(int, const SourceFrame& frame, const State& state,
                    const UpdateReport&) override {
      ++estimates;
      ASSERT_EQ(lines.size(), estimates);
      ASSERT_TRUE(lines.back().ends_with("}\n"));
      const std::string& line = lines.back();
      EXPECT_EQ(NumberOf(line, "t_s"), Seconds(frame.timestamp));
      EXPECT_EQ(NumberOf(line, "target.depth"), ValueOf(state, "target.depth"));
      EXPECT_EQ(NumberOf(line, "sigma:target.depth"),
                std::sqrt(CovarianceOf(state, "target.depth", "target.depth")));
      EXPECT_TRUE(std::isfinite(NumberOf(line, "target.depth_rate")));
    }
    const std::vector<std::string>& lines;
    std::size_t estimates = 0;
  } after(lines);
  RunOptions options;
  options.observers = {&follower, &after};
  alidade::Run(experiment, options);
  EXPECT_EQ(lines.size(), 5 * experiment.estimators.size());
  EXPECT_NE(lines[0].find("\"estimator\":\"ekf\""), std::string::npos) << lines[0];
}

TEST(Follower, LeavesOutWhatHasNoValueYetAndSigmasOfConstants) {
  Experiment experiment = MakeExperiment(1);
  Problem& problem = experiment.estimators[0].problem;
  const BlockId aside =
      problem.layout.Declare("aside.x", "aside", problem.layout[0].space, BlockStatus::kConstant);
  State state(problem.layout);
  std::vector<std::string> lines;
  Follower follower([&](std::string_view line) { lines.emplace_back(line); });
  follower.Begin(experiment);
  const double one = 1.0;
  state.Add(aside, &one, Eigen::MatrixXd());
  follower.OnEstimate(0, {FrameAt(0.5, {})}, state, {});
  ASSERT_EQ(lines.size(), 1u);
  EXPECT_EQ(lines[0], "{\"t_s\":0.5,\"estimator\":\"ekf\",\"aside.x\":1.0}\n");
}

}  // namespace
}  // namespace alidade::testing
