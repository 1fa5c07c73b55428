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

TEST(Summarise, TakesMetricsOverWholeRunsThatDidNotDiverge) {
  SweepResult result;
  result.runs = 4;
  result.estimators = {"ekf"};
  result.done = {{1, RunStatus::kOk, ExitCode::kOk, "", {Diverged(false, 1.0)}},
                 {2, RunStatus::kOk, ExitCode::kOk, "", {Diverged(false, 2.0)}},
                 {3, RunStatus::kOk, ExitCode::kOk, "", {Diverged(true, 100.0)}},
                 {4, RunStatus::kFailed, ExitCode::kBadData, "", {Diverged(false, 50.0)}}};
  const std::vector<SweepSummary> summaries = Summarise(result);
  ASSERT_EQ(summaries.size(), 1u);
  EXPECT_EQ(summaries[0].used, 2);
  EXPECT_EQ(summaries[0].diverged, 1);
  EXPECT_DOUBLE_EQ(summaries[0].metrics.at("rmse:x").mean, 1.5);
  EXPECT_DOUBLE_EQ(summaries[0].metrics.at("rmse:x").p95, 1.95);
}

}  // namespace
}  // namespace alidade
