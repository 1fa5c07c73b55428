// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "alidade/compare/compare.h"

namespace alidade {
namespace {

bool Contains(const std::string& text, const std::string& part) {
  return text.find(part) != text.npos;
}

Spread Single(double value) { return {value, value, value, value}; }

/// Returns a comparison of one filter with `reference`.
Comparison Compared(const std::string& reference, const std::vector<std::string>& keys) {
  Comparison comparison;
  comparison.frames = 10;
  comparison.reference = reference;
  ComparedEstimator& ekf = comparison.estimators.emplace_back();
  ekf.name = "ekf";
  ekf.used = 1;
  for (const std::string& key : keys) ekf.values[key] = Single(1.0);
  return comparison;
}

TEST(CompareReport, ShowsErrorsFirstWhereTruthIsKnown) {
  const Comparison comparison =
      Compared("truth", {"rmse:p.x", "rmsd:p.x", "nees.mean:p", "nis.mean:s", "final_error:p.x"});
  const std::string main = CompareReport(comparison, TableStyle::kText, ReportRows::kMain);
  EXPECT_TRUE(Contains(main, "\nrmse p.x")) << main;
  EXPECT_TRUE(Contains(main, "\nNEES p")) << main;
  EXPECT_FALSE(Contains(main, "RMSD")) << main;
  EXPECT_FALSE(Contains(main, "NIS")) << main;
  EXPECT_FALSE(Contains(main, "At the end")) << main;
  EXPECT_TRUE(main.ends_with("\n\n3 more rows: --all\n")) << main;
  const std::string all = CompareReport(comparison, TableStyle::kText);
  for (const char* row : {"\nrmse p.x", "\nRMSD p.x", "\nNEES p", "\nNIS s", "\nerror p.x"}) {
    EXPECT_TRUE(Contains(all, row)) << all;
  }
  EXPECT_FALSE(Contains(all, "--all")) << all;
}

TEST(CompareReport, ShowsDifferencesFirstWithoutTruth) {
  const Comparison comparison = Compared("batch", {"rmsd:p.x", "nis.mean:s"});
  const std::string main = CompareReport(comparison, TableStyle::kText, ReportRows::kMain);
  EXPECT_TRUE(Contains(main, "\nRMSD p.x")) << main;
  EXPECT_TRUE(main.ends_with("\n\n1 more rows: --all\n")) << main;
}

TEST(CompareReport, NamesNoRowsIfNoneIsLeftOut) {
  const Comparison comparison = Compared("truth", {"rmse:p.x"});
  EXPECT_FALSE(Contains(CompareReport(comparison, TableStyle::kText, ReportRows::kMain), "--all"));
}

TEST(CompareReport, NamesTheVerdictOrCountsTheRunsWithIt) {
  Comparison comparison = Compared("truth", {"rmse:p.x"});
  auto& verdicts = comparison.estimators[0].verdicts;
  verdicts[static_cast<std::size_t>(VerdictState::kConsistent)] = 1;
  const std::string one = CompareReport(comparison, TableStyle::kText);
  EXPECT_TRUE(Contains(one, "\nverdict   consistent\n")) << one;
  comparison.runs = 20;
  verdicts[static_cast<std::size_t>(VerdictState::kConsistent)] = 18;
  verdicts[static_cast<std::size_t>(VerdictState::kLost)] = 2;
  const std::string several = CompareReport(comparison, TableStyle::kText);
  EXPECT_TRUE(Contains(several, "  2 lost, 18 consistent ")) << several;
}

// With fewer than ten runs, the report states that there are too few, regardless of their interval.
TEST(CompareReport, IntervalsOfFewRunsAreSaidToBeSo) {
  for (const std::int64_t runs : {3, 9, 10}) {
    Comparison comparison = Compared("truth", {"rmse:p.x"});
    comparison.runs = runs;
    comparison.estimators[0].ratios["rmse:p.x"] = {2.0, 1.0, runs, Interval{1.9, 2.1}};
    const std::string text = CompareReport(comparison, TableStyle::kText);
    EXPECT_TRUE(Contains(text, "2.0000 [1.9000, 2.1000]")) << text;
    EXPECT_EQ(Contains(text, "2.1000] too few runs"), runs < 10) << text;
    EXPECT_EQ(Contains(text, "too few runs: with fewer than 10"), runs < 10) << text;
  }
}

TEST(CompareReport, ErrorsByTheirBoundAreNoRatiosToAReference) {
  Comparison comparison = Compared("truth", {"rmse:p.x"});
  comparison.runs = 20;
  comparison.estimators[0].ratios["mse_by_bound:p.x"] = {1.2, 1.0, 20, Interval{1.1, 1.3}};
  const std::string text = CompareReport(comparison, TableStyle::kText, ReportRows::kMain);
  EXPECT_TRUE(Contains(text, "  1.2000 +- 0.1 ")) << text;
  EXPECT_TRUE(Contains(text, "MSE / Cramer-Rao bound: mean square error / smallest")) << text;
  EXPECT_FALSE(Contains(text, "  ratio: mean error")) << text;
}

}  // namespace
}  // namespace alidade
