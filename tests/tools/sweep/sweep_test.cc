// SPDX-License-Identifier: Apache-2.0
#include "alidade/sweep/sweep.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <limits>

#include "alidade/replay/run_inputs.h"
#include "support/recording.h"

namespace alidade {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST(Quantile, IsLinearBetweenOrderStatistics) {
  // The expected values are those of numpy.quantile([1, 2, 4, 8], q), which interpolates at the
  // index 3 q.
  const std::vector<double> x = {1, 2, 4, 8};
  EXPECT_DOUBLE_EQ(Quantile(x, 0.0), 1.0);
  EXPECT_DOUBLE_EQ(Quantile(x, 0.05), 1.15);
  EXPECT_DOUBLE_EQ(Quantile(x, 0.5), 3.0);
  EXPECT_DOUBLE_EQ(Quantile(x, 0.95), 7.4);
  EXPECT_DOUBLE_EQ(Quantile(x, 1.0), 8.0);
  EXPECT_EQ(Quantile({5.0}, 0.95), 5.0);
  EXPECT_THROW(static_cast<void>(Quantile({}, 0.5)), ContractViolation);
}

TEST(Quantile, OfInfiniteValuesIsNotNan) {
  EXPECT_EQ(Quantile({1.0, kInfinity, kInfinity}, 0.95), kInfinity);
  EXPECT_EQ(Quantile({1.0, 2.0, kInfinity}, 0.5), 2.0);
}

using Metrics = std::map<std::string, double>;

/// Returns a copy of the run `to` with additional metrics.
SweepRow Add(const SweepRow& to, const Metrics& more) {
  EstimatorResult one;
  one.name = to.name;
  one.diverged = to.diverged;
  one.verdict.state = to.verdict;
  one.metrics = more;
  for (std::size_t i = 0; i < to.metrics.names().size(); ++i) {
    one.metrics.try_emplace(to.metrics.names()[i], to.metrics.values()[i]);
  }
  return SweepRow(one);
}

SweepRow Result(double rmse, bool diverged = false, bool lost = false) {
  SweepRow one;
  one.name = "ekf";
  one.diverged = diverged;
  one.verdict = diverged ? VerdictState::kDiverged
                : lost   ? VerdictState::kLost
                         : VerdictState::kConsistent;
  return Add(one, {{"rmse:x", rmse}});
}

/// Returns six runs. Three of the runs count, and one of these three is lost. Two runs
/// diverged, and one lost run failed.
SweepResult SixRuns() {
  SweepResult result;
  result.runs = 6;
  result.estimators = {"ekf"};
  result.done = {{1, RunStatus::kOk, ExitCode::kOk, "", {Result(1.0)}},
                 {2, RunStatus::kOk, ExitCode::kOk, "", {Result(2.0)}},
                 {3, RunStatus::kOk, ExitCode::kOk, "", {Result(100.0, true)}},
                 {4, RunStatus::kFailed, ExitCode::kBadData, "", {Result(50.0, false, true)}},
                 {5, RunStatus::kOk, ExitCode::kOk, "", {Result(6.0, false, true)}},
                 {6, RunStatus::kOk, ExitCode::kOk, "", {Result(100.0, true, true)}}};
  return result;
}

TEST(Summarise, TakesMetricsOverWholeRunsThatDidNotDiverge) {
  const std::vector<SweepSummary> summaries = Summarise(SixRuns());
  ASSERT_EQ(summaries.size(), 1u);
  EXPECT_EQ(summaries[0].used, 3);
  EXPECT_EQ(summaries[0].diverged, 2);
  EXPECT_EQ(summaries[0].CountOf(VerdictState::kLost), 1);
  EXPECT_DOUBLE_EQ(summaries[0].metrics.at("rmse:x").mean, 3.0);
  EXPECT_DOUBLE_EQ(summaries[0].metrics.at("rmse:x").p95, 5.6);
}

TEST(Summarise, LeavesOutWhatIsNotANumber) {
  SweepResult result = SixRuns();
  for (SweepRun& run : result.done) {
    run.estimators[0] =
        Add(run.estimators[0], {{"rmse:never", std::numeric_limits<double>::quiet_NaN()}});
  }
  SweepRow& first = result.done[0].estimators[0];
  first = Add(first, {{"rmse:x", std::numeric_limits<double>::quiet_NaN()}});
  SweepRow& second = result.done[1].estimators[0];
  // This metric exists in one run only. Its key comes before the keys of the other runs.
  second = Add(second, {{"rmse:a", 7.0}});
  const std::vector<SweepSummary> summaries = Summarise(result);
  EXPECT_FALSE(summaries[0].metrics.contains("rmse:never"));
  EXPECT_DOUBLE_EQ(summaries[0].metrics.at("rmse:x").mean, 4.0);
  EXPECT_DOUBLE_EQ(summaries[0].metrics.at("rmse:a").mean, 7.0);
}

std::string TableOf(const SweepResult& result) { return SweepTable(result, Summarise(result)); }

TEST(SweepFolder, RunsHaveTheirValuesInTheColumnsOfAll) {
  SweepResult result = SixRuns();
  result.done.resize(3);
  SweepRow& first = result.done[0].estimators[0];
  first = Add(first, {{"rmse:y", 5.0}});
  SweepRow& third = result.done[2].estimators[0];
  third = Add(third, {{"rmse:a", 7.0}, {"nis.mean:y", 8.0}});
  const testing::TemporaryFolder temporary;
  SweepFolder(temporary / "out", false)
      .Write(result, Summarise(result), Config::FromText("{}", ""));
  const std::vector<std::string> lines = testing::Lines(temporary / "out/runs.csv");
  ASSERT_EQ(lines.size(), 4u);
  EXPECT_EQ(lines[0], "seed,estimator,verdict,rmse:a,rmse:x,rmse:y,nis.mean:y");
  EXPECT_EQ(lines[1], "1,ekf,consistent,,1,5,");
  EXPECT_EQ(lines[2], "2,ekf,consistent,,2,,");
  EXPECT_EQ(lines[3], "3,ekf,diverged,7,100,,8");
}

// The results written at a stop cover only the runs before the stop, so a resumed sweep removes
// them.
TEST(SweepFolder, AStoppedOneIsContinuedWithoutItsResults) {
  const testing::TemporaryFolder temporary;
  const Config config = Config::FromText("{}", "config.yaml");
  const std::string inputs = internal::InputsJson({{"sweep"}, {}, {}}, config, {}, {});
  SweepResult result = SixRuns();
  result.stopped = true;
  SweepFolder({temporary / "out", false, inputs}, config).Write(result, Summarise(result), config);
  const std::filesystem::path partial = temporary / "out.partial";
  EXPECT_TRUE(std::filesystem::exists(partial / "failures.csv"));
  EXPECT_FALSE(std::filesystem::exists(temporary / "out"));
  const SweepFolder resumed({temporary / "out", false, inputs, true}, config);
  EXPECT_EQ(testing::FilesIn(partial),
            (std::vector<std::string>{"config.resolved.yaml", "files.txt", "finished_runs.jsonl",
                                      "inputs.json", "sweep.json"}));
  EXPECT_EQ(testing::Lines(partial / "sweep.json").at(1), "  \"status\": \"running\"");
}

TEST(Sweep, ItsRunsShareTheirNames) {
  const Config config = Config::FromFile(std::filesystem::path(ALIDADE_SOURCE_DIR) /
                                         "examples/05_depth_principled/config.yaml");
  const PluginHost host(PluginPaths(config));
  SweepOptions options;
  options.runs = 8;
  options.jobs = 2;
  const SweepResult result = Sweep(config, host, options);
  ASSERT_EQ(result.done.size(), 8u);
  const SweepRow& first = result.done[0].estimators.at(0);
  EXPECT_FALSE(first.metrics.names().empty());
  for (const SweepRun& run : result.done) {
    EXPECT_EQ(&run.estimators.at(0).metrics.names(), &first.metrics.names()) << run.seed;
    EXPECT_EQ(&run.estimators.at(0).counts.names(), &first.counts.names()) << run.seed;
    EXPECT_EQ(&run.estimators.at(0).units.names(), &first.units.names()) << run.seed;
  }
}

// The values are 1, 2 and 6, so s = sqrt(7). The half width of the interval is 4.3027 s / sqrt(3)
// = 6.572.
TEST(SweepTable, HasCountsOfVerdictsAndLabelledStatistics) {
  EXPECT_EQ(
      TableOf(SixRuns()),
      "ekf diverged in 2 of 5 runs. (95 % interval 12 % to 77 %)\n\n"
      "            ekf\n"
      "runs used     3\n"
      "diverged      2\n"
      "lost          1\n"
      "consistent    2\n"
      "\n"
      "Mean over the used runs, 95 % interval of this mean, and quantiles over the used runs:\n"
      "        mean  95 % interval   5 %  median  95 %\n"
      "rmse x  3.00  [-3.57, 9.57]  1.10    2.00  5.60\n");
}

TEST(SweepTable, ReportsAMeanNeesThatFailsOverTheRuns) {
  SweepResult result = SixRuns();
  for (SweepRun& run : result.done) {
    run.estimators[0] = Add(run.estimators[0], {{"nees.mean:x", 9.0}, {"nees.dof:x", 2.0}});
  }
  // Three runs have two degrees of freedom each: chi2(1 - 8e-7; 6) / 6 = 6.4.
  const std::string line =
      "\nekf: over 3 runs, the NEES of x is 9, and 1 is expected: the filter is overconfident, "
      "even "
      "if single runs are too short to show it.\n\n";
  EXPECT_NE(TableOf(result).find(line), std::string::npos) << TableOf(result);
  for (SweepRun& run : result.done) {
    run.estimators[0] = Add(run.estimators[0], {{"nees.mean:x", 4.0}});
  }
  // A mean outside its 95 % bounds is no proof yet: chi2(0.975; 6) / 6 = 2.408.
  EXPECT_NE(
      TableOf(result).find("\nekf: over 3 runs, the NEES of x is 4, and 1 is expected: the "
                           "filter may be slightly overconfident. (95 % bounds [0.206, 2.41])\n"),
      std::string::npos)
      << TableOf(result);
}

TEST(SweepTable, CountsTheRunsThatHaveTheMetric) {
  SweepResult result = SixRuns();
  result.done[0].estimators[0] =
      Add(result.done[0].estimators[0], {{"nees.mean:x", 9.0}, {"nees.dof:x", 2.0}});
  const std::string table = TableOf(result);
  EXPECT_EQ(table.find("nan"), std::string::npos) << table;
  // One run has two degrees of freedom: chi2(1 - 8e-7; 2) / 2 = 14.
  EXPECT_EQ(table.find("is expected"), std::string::npos) << table;
}

TEST(SweepTable, HasARowForEachEstimator) {
  SweepResult result = SixRuns();
  result.estimators = {"ekf", "a", "b", "c"};
  for (SweepRun& run : result.done) {
    for (const char* name : {"a", "b", "c"}) {
      run.estimators.push_back(run.estimators[0]);
      run.estimators.back().name = name;
    }
  }
  const std::string table = TableOf(result);
  EXPECT_NE(table.find("\nrmse x        ekf  3.00 "), std::string::npos) << table;
  EXPECT_NE(table.find("\n                c  3.00 "), std::string::npos) << table;
}

}  // namespace
}  // namespace alidade
