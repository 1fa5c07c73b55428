// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/metric_rows.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <sstream>

#include "alidade/experiment/run.h"

namespace alidade {
namespace {

EstimatorResult Named(const std::string& name, std::map<std::string, double> metrics) {
  EstimatorResult result;
  result.name = name;
  result.metrics = std::move(metrics);
  result.units = {{"target.depth", "m"}, {"cam.heading", "rad"}, {"cam.pixel", "px"}};
  return result;
}

TEST(ComparisonTable, OrdersScalesAndAligns) {
  RunResult result;
  result.estimators = {Named("fused", {{"rmse:target.depth", 0.002145},
                                       {"rmse:target.depth@blind", 0.00121},
                                       {"rmse:cam.pixel", 0.31},
                                       {"lag_ms:target.depth", -1.42},
                                       {"coverage95:target.depth", 0.9342},
                                       {"coverage95:target.depth@blind", 0.9},
                                       {"nees.mean:target", 0.8948},
                                       {"nees.within95:target", 1.0},
                                       {"nis.mean:stereo", 0.9059},
                                       {"final_error:target.depth", 1.0}}),
                       Named("stereo_only", {{"rmse:target.depth", 0.206534}})};
  result.estimators[0].counts = {{"accepted:stereo", 74}, {"gated:stereo", 1}};
  result.estimators[1].verdict.state = VerdictState::kDiverged;
  result.estimators[0].verdict.state = VerdictState::kLost;
  EXPECT_EQ(ComparisonTable(result),
            "                                     fused  stereo_only\n"
            "verdict                               lost     diverged\n"
            "rmse cam.pixel [px]                 0.3100            -\n"
            "rmse target.depth [mm]               2.145        206.5\n"
            "rmse target.depth @blind [mm]        1.210            -\n"
            "lag target.depth [ms]               -1.420            -\n"
            "coverage95 target.depth [%]          93.42            -\n"
            "coverage95 target.depth @blind [%]   90.00            -\n"
            "nees.mean target                    0.8948            -\n"
            "nees.within95 target [%]             100.0            -\n"
            "nis.mean stereo                     0.9059            -\n"
            "accepted stereo                         74            -\n"
            "gated stereo                             1            -\n");
}

TEST(ComparisonTable, PrintsNumbersThatLieFarApart) {
  RunResult result;
  const double inf = std::numeric_limits<double>::infinity();
  for (const double rmse : {1.95e-5, 0.0, 250.0, 3e12, 4e-7, inf}) {
    const std::string name = std::string(1, static_cast<char>('a' + result.estimators.size()));
    result.estimators.push_back(Named(name, {{"rmse:cam.pixel", rmse}}));
  }
  const std::string table = ComparisonTable(result);
  EXPECT_NE(table.find("rmse cam.pixel [px]  0.00001950           0       250.0   3.000e+12   "
                       "4.000e-07         inf\n"),
            std::string::npos)
      << table;
}

TEST(ComparisonTable, KeepsOneUnitThroughoutTheTable) {
  RunResult result;
  result.estimators = {Named("ekf", {{"rmse:target.depth", 0.9},
                                     {"rmse:target.depth@blind", 1.2},
                                     {"rmse:target.depth@seeing", 0.004}})};
  EXPECT_EQ(ComparisonTable(result),
            "                                      ekf\n"
            "verdict                        not tested\n"
            "rmse target.depth [m]              0.9000\n"
            "rmse target.depth @blind [m]        1.200\n"
            "rmse target.depth @seeing [m]    0.004000\n");
}

TEST(ComparisonTable, SmallNumbersKeepTheirDigits) {
  RunResult result;
  result.estimators = {Named("a", {{"nees.mean:target", 3.21e-6}}),
                       Named("b", {{"nees.mean:target", 4.5e-6}})};
  EXPECT_NE(ComparisonTable(result).find("nees.mean target   3.210e-06   4.500e-06\n"),
            std::string::npos)
      << ComparisonTable(result);
}

TEST(ComparisonTable, LeavesOutWhatIsHeldAtTruth) {
  RunResult result;
  result.estimators = {Named("a", {{"rmse:target.depth", 0.0},
                                   {"coverage95:target.depth", 1.0},
                                   {"nees.mean:target", 0.0},
                                   {"nees.within95:target", 1.0}}),
                       Named("b", {})};
  EXPECT_EQ(ComparisonTable(result),
            "                  a           b\nverdict  not tested  not tested\n");
  result.estimators[1].metrics = {{"rmse:target.depth", 0.1}};  // estimator b estimates this block
  EXPECT_NE(ComparisonTable(result).find("rmse target.depth"), std::string::npos);
}

TEST(ComparisonTable, FoldsWhatIsWiderThanALine) {
  RunResult result;
  for (int i = 0; i < 12; ++i) {
    result.estimators.push_back(
        Named("estimator_" + std::to_string(i), {{"rmse:target.depth", 1.0 + i}}));
  }
  std::istringstream table(ComparisonTable(result));
  std::string line;
  int headers = 0, widest = 0;
  while (std::getline(table, line)) {
    headers += line.starts_with("   ");
    widest = std::max(widest, static_cast<int>(line.size()));
  }
  EXPECT_EQ(headers, 3);
  EXPECT_LE(widest, 100);
  EXPECT_GT(widest, 60);
}

// The table must contain the row of the verdict, all five rows of the first round and four rows of
// the second round. In all there are 9 rows of blocks, 6 of segments (without lag), 4 means, 3
// counts and the verdict. Of these 23 rows, 13 are omitted.
TEST(MainRows, AreDealtOutInTheOrderOfTheConfig) {
  RunResult result;
  std::map<std::string, double> metrics;
  for (const char* block : {"cam.heading", "cam.position", "cam.velocity"}) {
    for (const char* kind : {"rmse:", "coverage95:", "lag_ms:"}) {
      metrics[kind + std::string(block)] = 0.5;
      metrics[kind + std::string(block) + "@blind"] = 0.5;
    }
  }
  for (const char* owner : {"cam", "map"}) metrics[std::string("nees.mean:") + owner] = 0.5;
  for (const char* sensor : {"left", "right"}) metrics[std::string("nis.mean:") + sensor] = 0.5;
  result.estimators = {Named("ekf", metrics)};
  result.estimators[0].counts = {{"accepted:left", 3}, {"accepted:right", 4}, {"gated:left", 1}};
  const std::vector<std::string> subjects = {"cam.position", "cam",   "cam.heading",
                                             "cam.velocity", "right", "left"};
  std::vector<std::string> labels;
  for (const auto& row : internal::MainRows(result, subjects)) labels.push_back(row.label);
  EXPECT_EQ(labels, (std::vector<std::string>{
                        "verdict", "rmse cam.heading [mrad]", "rmse cam.position",
                        "coverage95 cam.position [%]", "nees.mean cam", "nees.mean map",
                        "nis.mean left", "nis.mean right", "accepted left", "accepted right"}));
  EXPECT_NE(internal::MainTable(result, subjects).find("\n13 more rows: --all\n"),
            std::string::npos)
      << internal::MainTable(result, subjects);
}

// The map is not one of the subjects. The rows of the map belong to the first round, and their unit
// is that of the position.
TEST(MainRows, HaveTheErrorOfTheMapBeforeThatAfterAlignment) {
  std::map<std::string, double> metrics = {{"map.rmse", 0.012}, {"map.sim3.rmse", 0.007}};
  for (const char* block : {"cam.position", "cam.velocity", "cam.heading"}) {
    for (const char* kind : {"rmse:", "coverage95:", "nees.mean:"}) {
      metrics[kind + std::string(block)] = 0.5;
    }
  }
  RunResult result;
  result.estimators = {Named("ekf", metrics)};
  result.estimators[0].units = {{"cam.position", "m"}};
  std::vector<internal::TableRow> rows = internal::MainRows(result, {"cam.position"});
  ASSERT_EQ(rows.size(), 10u);
  const auto map = std::ranges::find(rows, "map.rmse [mm]", &internal::TableRow::label);
  ASSERT_NE(map, rows.end());
  EXPECT_EQ(map->cells, std::vector<std::string>{"12.00"});
  EXPECT_EQ(std::next(map)->label, "map.sim3.rmse [mm]");
}

TEST(MetricRows, LabelACountWithoutASubjectByItsName) {
  RunResult result;
  result.estimators = {Named("ekf", {})};
  result.estimators[0].counts = {{"landmarks.deleted", 3}, {"accepted:stereo", 7}};
  const std::vector<internal::TableRow> rows = internal::MetricRows(result);
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0].label, "accepted stereo");
  EXPECT_EQ(rows[1].label, "landmarks.deleted");
}

TEST(MainRows, AreAllOfThemWhereTheyAreNoMoreThanTen) {
  RunResult result;
  result.estimators = {Named("ekf", {{"rmse:target.depth", 0.5}, {"lag_ms:target.depth", 1.0}})};
  EXPECT_EQ(internal::MainRows(result, {}).size(), 3u);
  EXPECT_EQ(internal::MainTable(result, {}), ComparisonTable(result));
}

TEST(MarkdownTable, KeepsWhatWouldEndACell) {
  EXPECT_EQ(
      internal::FormatTable(internal::MakeTable({"rmse", "|e|"}, {{"a|b", {"1", "2"}}}, "`ekf`"),
                            internal::TableFormat::kMarkdown),
      "| `ekf` | rmse | \\|e\\| |\n|---|---:|---:|\n| a\\|b | 1 | 2 |\n");
}

TEST(ComparisonTable, WithoutEstimatorsIsEmpty) { EXPECT_EQ(ComparisonTable({}), ""); }

TEST(ValueText, HasThePrefixOfTheLargestError) {
  const EstimatorResult estimator = Named("ekf", {{"rmse:target.depth", 0.002044},
                                                  {"rmse:target.depth@blind", 0.000994},
                                                  {"coverage95:target.depth", 0.9539}});
  EXPECT_EQ(internal::ValueText(estimator, "rmse:target.depth"), "2.04 mm");
  EXPECT_EQ(internal::ValueText(estimator, "rmse:target.depth@blind"), "0.994 mm");
  EXPECT_EQ(internal::ValueText(estimator, "coverage95:target.depth"), "95.4 %");
  EXPECT_EQ(internal::ValueText("rmse:target.depth", 0.000994, "m"), "994 um");
}

/// Returns an estimator with the verdict `lost` and findings with the given texts.
EstimatorResult WithFindings(const std::string& name, const std::vector<std::string>& texts) {
  EstimatorResult estimator;
  estimator.name = name;
  estimator.verdict = {.state = VerdictState::kLost, .because = "far off"};
  for (const std::string& text : texts) {
    estimator.findings.push_back({FindingKind::kBias, "gnss", text, 0.0});
  }
  return estimator;
}

TEST(VerdictText, ShowsThreeFindingsAndCountsTheOthers) {
  RunResult result;
  result.estimators = {WithFindings("ekf", {"one"})};
  EXPECT_EQ(VerdictText(result), "ekf  lost: far off\n     one\n");
  result.estimators = {WithFindings("ekf", {"one", "far off", "two", "three", "four"})};
  EXPECT_EQ(
      VerdictText(result),
      "ekf  lost: far off\n     one\n     two\n     three\n"
      "     the first of these findings usually explains the others; `alidade diagnose` lists "
      "1 more\n");
}

TEST(VerdictText, MarksAnEstimatorThatIsExpectedToBePoor) {
  RunResult result;
  result.estimators = {WithFindings("ekf", {})};
  result.estimators[0].expects_poor = true;
  EXPECT_EQ(VerdictText(result), "ekf  lost (poor is expected): far off\n");
}

TEST(VerdictText, DoesNotRepeatTheFindingsOfAnEarlierEstimator) {
  RunResult result;
  result.estimators = {WithFindings("ekf", {"one"}), WithFindings("ukf", {"two"}),
                       WithFindings("rts", {"one"}), WithFindings("lag", {})};
  EXPECT_EQ(VerdictText(result),
            "ekf  lost: far off\n     one\nukf  lost: far off\n     two\n"
            "rts  lost: far off\n     the same findings as for ekf\nlag  lost: far off\n");
}

}  // namespace
}  // namespace alidade
