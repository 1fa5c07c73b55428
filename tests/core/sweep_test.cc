// SPDX-License-Identifier: Apache-2.0
#include "alidade/sweep.h"

#include <gtest/gtest.h>

#include <limits>

namespace alidade {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST(Quantile, IsLinearBetweenOrderStatistics) {
  // numpy.quantile([1, 2, 4, 8], q): h = 3 q
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

EstimatorResult Diverged(bool diverged, double rmse) {
  EstimatorResult one;
  one.name = "ekf";
  one.diverged = diverged;
  one.metrics["rmse:x"] = rmse;
  return one;
}

/// Two runs that count, one that diverged, one that failed.
SweepResult FourRuns() {
  SweepResult result;
  result.runs = 4;
  result.estimators = {"ekf"};
  result.done = {{1, RunStatus::kOk, ExitCode::kOk, "", {Diverged(false, 1.0)}},
                 {2, RunStatus::kOk, ExitCode::kOk, "", {Diverged(false, 2.0)}},
                 {3, RunStatus::kOk, ExitCode::kOk, "", {Diverged(true, 100.0)}},
                 {4, RunStatus::kFailed, ExitCode::kBadData, "", {Diverged(false, 50.0)}}};
  return result;
}

TEST(Summarise, TakesMetricsOverWholeRunsThatDidNotDiverge) {
  const std::vector<SweepSummary> summaries = Summarise(FourRuns());
  ASSERT_EQ(summaries.size(), 1u);
  EXPECT_EQ(summaries[0].used, 2);
  EXPECT_EQ(summaries[0].diverged, 1);
  EXPECT_DOUBLE_EQ(summaries[0].metrics.at("rmse:x").mean, 1.5);
  EXPECT_DOUBLE_EQ(summaries[0].metrics.at("rmse:x").p95, 1.95);
}

TEST(SweepTable, HasQuantilesAndCountsOfRuns) {
  EXPECT_EQ(SweepTable(FourRuns()),
            "                                   ekf\n"
            "rmse x     1.500 [1.050, 1.500, 1.950]\n"
            "runs used                            2\n"
            "diverged                             1\n");
}

TEST(SweepTable, FoldsAsAComparisonDoes) {
  SweepResult result = FourRuns();
  result.estimators = {"ekf", "a", "b", "c"};
  for (SweepRun& run : result.done) {
    for (const char* name : {"a", "b", "c"}) {
      run.estimators.push_back(run.estimators[0]);
      run.estimators.back().name = name;
    }
  }
  // 9 of the label and three times 29 are 96 characters; the fourth goes below.
  const std::string table = SweepTable(result);
  EXPECT_EQ(table.find('\n'), 96u) << table;
  EXPECT_NE(table.find("\n\n" + std::string(37, ' ') + "c\nrmse x "), std::string::npos) << table;
}

}  // namespace
}  // namespace alidade
