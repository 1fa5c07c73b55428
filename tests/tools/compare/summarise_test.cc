// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>

#include "alidade/compare/compare.h"

namespace alidade {
namespace {

/// Returns a run with two estimators. The second estimator is the reference of the first.
Comparison OneRun(double error, bool filter_diverged = false) {
  Comparison one;
  one.decomposed = "ekf";
  one.estimators.resize(2);
  ComparedEstimator& filter = one.estimators[0];
  filter.name = "ekf";
  filter.diverged = filter_diverged ? 1 : 0;
  const VerdictState state = filter_diverged ? VerdictState::kDiverged : VerdictState::kConsistent;
  filter.verdicts[static_cast<std::size_t>(state)] = 1;
  filter.values["rmse:x"] = {error, error, error, error};
  if (!filter_diverged) {
    filter.reference = filter.final_reference = "batch";
    filter.reference_runs = filter.final_reference_runs = 1;
    filter.ratios["rmse:x"] = {error, 2.0};
  }
  one.estimators[1].name = "batch";
  DecompositionStep& step = one.decomposition.emplace_back();
  step.kind = DecompositionKind::kRejected;
  step.estimator = "accepted";
  step.reference = "batch";
  step.values["rejected"] = {error, error, error, error};
  return one;
}

// A run in which a filter diverged is not counted in the numbers of this filter.
TEST(Summarise, LeavesOutTheRunsInWhichTheFilterDiverged) {
  const Comparison all = Summarise({OneRun(6.0, true), OneRun(1.0), OneRun(2.0)});
  EXPECT_EQ(all.runs, 3);
  const ComparedEstimator& filter = all.estimators[0];
  EXPECT_EQ(filter.diverged, 1);
  EXPECT_EQ(filter.used, 2);
  EXPECT_EQ(filter.reference, "batch");
  EXPECT_EQ(filter.reference_runs, 2);
  EXPECT_EQ(filter.values.at("rmse:x").mean, 1.5);
  EXPECT_NEAR(filter.values.at("rmse:x").p50, 1.5, 1e-15);
  EXPECT_EQ(filter.ratios.at("rmse:x").value(), 0.75);
  EXPECT_EQ(filter.ratios.at("rmse:x").runs, 2);
  EXPECT_EQ(all.estimators[1].used, 3);
  EXPECT_EQ(all.decomposition[0].values.at("rejected").mean, 1.5);
}

TEST(Summarise, CountsTheVerdictsOfAllRuns) {
  const Comparison all = Summarise({OneRun(6.0, true), OneRun(1.0), OneRun(2.0)});
  const auto count_of = [&](VerdictState state) {
    return all.estimators[0].verdicts[static_cast<std::size_t>(state)];
  };
  EXPECT_EQ(count_of(VerdictState::kDiverged), 1);
  EXPECT_EQ(count_of(VerdictState::kConsistent), 2);
  EXPECT_EQ(count_of(VerdictState::kLost), 0);
}

// If an estimator failed in one of the runs, the summary reports it.
TEST(Summarise, OfSeedsHasTheStatusOfTheSweep) {
  Comparison failed = OneRun(1.0);
  failed.status = RunStatus::kFailed;
  EXPECT_EQ(Summarise({failed}).status, RunStatus::kOk);
  EXPECT_EQ(Summarise({OneRun(1.0), failed}).status, RunStatus::kOk);
}

TEST(Summarise, SaysInHowManyRunsANoteHolds) {
  Comparison one = OneRun(1.0), two = OneRun(2.0);
  one.notes = {"both"};
  two.notes = {"both", "second"};
  EXPECT_EQ(Summarise({one, two}).notes,
            (std::vector<std::string>{"both", "second (1 of 2 runs)"}));
}

TEST(Summarise, TakesAStepBetweenTheSameTwoAlone) {
  Comparison other = OneRun(7.0);
  other.decomposition[0].reference = "another";
  EXPECT_EQ(Summarise({OneRun(1.0), other}).decomposition[0].values.at("rejected").mean, 1.0);
}

TEST(Summarise, LeavesOutWhatIsNoNumber) {
  const Comparison all = Summarise({OneRun(1.0), OneRun(std::nan("")), OneRun(3.0)});
  const Spread spread = all.estimators[0].values.at("rmse:x");
  EXPECT_EQ(spread.mean, 2.0);
  EXPECT_NEAR(spread.p95, 2.9, 1e-15);
  EXPECT_TRUE(std::isnan(Summarise({OneRun(std::nan(""))}).estimators[0].values.at("rmse:x").mean));
}

TEST(Summarise, CountsTheRunsWithoutAReference) {
  Comparison without = OneRun(1.0);
  without.withheld = "no reference: estimator 'batch' failed, the comparison with it is withheld";
  const Comparison all = Summarise({OneRun(1.0), without});
  EXPECT_EQ(all.withheld, without.withheld + " (1 of 2 runs)");
}

TEST(CompareReport, LatexIsSafe) {
  Comparison one = OneRun(1.0);
  one.notes = {"50 % of $x_1$ {a} \\b ^ ~ # &"};
  const std::string text = CompareReport(one, TableStyle::kLatex);
  EXPECT_NE(text.find("50 \\% of \\$x\\_1\\$ \\{a\\} \\textbackslash{}b \\^{} \\~{} \\# \\&"),
            std::string::npos)
      << text;
}

}  // namespace
}  // namespace alidade
