// SPDX-License-Identifier: Apache-2.0
#include "alidade/sweep/conclusions.h"

#include <gtest/gtest.h>

namespace alidade::internal {
namespace {

using Metrics = std::map<std::string, double>;

SweepRow RowOf(const std::string& name, const Metrics& metrics, bool diverged = false) {
  EstimatorResult result;
  result.name = name;
  result.metrics = metrics;
  result.units = {{"x.position", "m"}};
  result.diverged = diverged;
  return SweepRow(result);
}

/// Returns three runs of two estimators. Their errors are 1, 2, 3 mm and 2, 1, 9 mm.
SweepResult TwoEstimators() {
  const double errors[3][2] = {{1e-3, 2e-3}, {2e-3, 1e-3}, {3e-3, 9e-3}};
  SweepResult result;
  result.runs = 3;
  result.estimators = {"ekf", "ukf"};
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    SweepRun& run = result.done.emplace_back();
    run.seed = seed;
    run.estimators = {RowOf("ekf", {{"rmse:x.position", errors[seed - 1][0]}}),
                      RowOf("ukf", {{"rmse:x.position", errors[seed - 1][1]}})};
  }
  return result;
}

std::vector<std::string> LinesOf(const SweepResult& result) {
  return ConclusionLines(ConclusionsOf(result, Summarise(result)));
}

SweepSummary SummaryOf(const std::string& name, double nees, std::int64_t used = 20) {
  SweepSummary summary;
  summary.name = name;
  summary.used = used;
  summary.metrics["nees.mean:x"].mean = nees;
  summary.metrics["nees.dof:x"].mean = 2.0;
  summary.metrics["nees.dof:x"].count = used;
  return summary;
}

TEST(SweepConclusions, NameTheEstimatorWithTheLeastError) {
  EXPECT_EQ(
      LinesOf(TwoEstimators()),
      (std::vector<std::string>{
          "ekf has the least rmse of x.position: 2 mm, mean of 3 runs. ukf has 4 mm, and more "
          "than ekf in 2 of 3 runs."}));
}

TEST(SweepConclusions, DoNotRankAnEstimatorThatDiverged) {
  SweepResult result = TwoEstimators();
  result.done[0].estimators[0] = RowOf("ekf", {{"rmse:x.position", 1e9}}, true);
  // Wilson: k = 1, n = 3.
  EXPECT_EQ(
      LinesOf(result),
      (std::vector<std::string>{"ekf diverged in 1 of 3 runs. (95 % interval 6.1 % to 79 %)"}));
}

// The mean of 20 values of chi2(2) / 2 has the 95 % bounds [0.611, 1.484].
TEST(SweepConclusions, TellConsistentFromOverconfident) {
  EXPECT_EQ(ConclusionLines(ConsistencyOf({SummaryOf("a", 1.1), SummaryOf("b", 0.9)})),
            (std::vector<std::string>{"a and b are consistent over the runs. (a: NEES x 1.1, 95 % "
                                      "bounds [0.611, 1.48]; b: NEES x 0.9, 95 % bounds [0.611, "
                                      "1.48])"}));
  EXPECT_EQ(ConclusionLines(ConsistencyOf({SummaryOf("a", 1.5)})),
            (std::vector<std::string>{"a: over 20 runs, the NEES of x is 1.5, and 1 is expected: "
                                      "the filter may be slightly overconfident. (95 % bounds "
                                      "[0.611, 1.48])"}));
  EXPECT_EQ(ConclusionLines(ConsistencyOf({SummaryOf("a", 9.0)})),
            (std::vector<std::string>{"a: over 20 runs, the NEES of x is 9, and 1 is expected: the "
                                      "filter is overconfident, even if single runs are too short "
                                      "to show it."}));
  EXPECT_EQ(ConclusionLines(ConsistencyOf({SummaryOf("a", 0.1)})),
            (std::vector<std::string>{"a: over 20 runs, the NEES of x is 0.1, and 1 is expected: "
                                      "the filter is underconfident, even if single runs are too "
                                      "short to show it."}));
}

TEST(SweepConclusions, AnErrorOfZeroIsNotTested) {
  EXPECT_TRUE(ConsistencyOf({SummaryOf("known", 0.0)}).empty());
}

TEST(SweepConclusions, NameTheBestValue) {
  VariedSweep sweep;
  sweep.variation.key = "source.sigma";
  sweep.variation.values = {"1", "2"};
  for (const double factor : {2.0, 1.0}) {
    SweepResult result = TwoEstimators();
    result.estimators = {"ekf"};
    for (SweepRun& run : result.done) {
      const double error = factor * *run.estimators[0].metrics.Find("rmse:x.position");
      run.estimators = {RowOf("ekf", {{"rmse:x.position", error}})};
    }
    sweep.results.push_back(result);
  }
  EXPECT_EQ(
      ConclusionLines(ConclusionsOf(sweep)),
      (std::vector<std::string>{
          "ekf has the least rmse of x.position at source.sigma = 2 (2 mm), then at 1 (4 mm). "
          "The errors are means of the runs."}));
}

}  // namespace
}  // namespace alidade::internal
