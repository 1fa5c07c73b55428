// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "alidade/compare/compare.h"

namespace alidade {
namespace {

bool Contains(const std::string& text, const std::string& part) {
  return text.find(part) != text.npos;
}

Spread Single(double value) { return {value, value, value, value}; }

/// One filter, compared with `reference`.
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

}  // namespace
}  // namespace alidade
