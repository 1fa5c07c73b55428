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
            "                                              fused  stereo_only\n"
            "verdict                                        lost     diverged\n"
            "rmse cam.pixel [px]                           0.310            -\n"
            "rmse target.depth [mm]                        2.15           207\n"
            "rmse target.depth @blind [mm]                 1.21             -\n"
            "lag target.depth [ms]                        -1.42             -\n"
            "inside 95 % region target.depth [%]          93.4              -\n"
            "inside 95 % region target.depth @blind [%]   90.0              -\n"
            "NEES target                                   0.895            -\n"
            "NEES inside 95 % region target [%]          100                -\n"
            "NIS stereo                                    0.906            -\n"
            "accepted stereo                              74                -\n"
            "gated stereo                                  1                -\n");
}

TEST(ComparisonTable, MarksTheMeansThatAgreeWithABadVerdict) {
  const auto mean = [](double nees, double nis, VerdictState state) {
    RunResult result;
    result.estimators = {Named("ekf", {{"nees.mean:target", nees},
                                       {"nees.low:target", 0.8},
                                       {"nees.high:target", 1.2},
                                       {"nis.mean:stereo", nis},
                                       {"nis.low:stereo", 0.9},
                                       {"nis.high:stereo", 1.1}})};
    result.estimators[0].verdict.state = state;
    std::string cells;
    for (const auto& row : internal::ComparisonRows(result)) cells += row.cells[0] + "; ";
    return cells;
  };
  EXPECT_EQ(mean(1.3, 0.5, VerdictState::kUnderconfident), "underconfident; 1.30; 0.500 !; ");
  EXPECT_EQ(mean(1.3, 0.5, VerdictState::kOverconfident), "overconfident; 1.30 !; 0.500; ");
  EXPECT_EQ(mean(1.3, 0.5, VerdictState::kLost), "lost; 1.30 !; 0.500 !; ");
  EXPECT_EQ(mean(1.3, 0.5, VerdictState::kConsistent), "consistent; 1.30; 0.500; ");
}

TEST(ComparisonTable, PrintsNumbersThatLieFarApart) {
  RunResult result;
  const double inf = std::numeric_limits<double>::infinity();
  for (const double rmse : {1.95e-5, 0.0, 250.0, 3e12, 4e-7, inf}) {
    const std::string name = std::string(1, static_cast<char>('a' + result.estimators.size()));
    result.estimators.push_back(Named(name, {{"rmse:cam.pixel", rmse}}));
  }
  const std::string table = ComparisonTable(result);
  EXPECT_NE(table.find("rmse cam.pixel [px]   0.0000195           0         250    3.00e+12    "
                       "4.00e-07         inf\n"),
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
            "rmse target.depth [m]             0.900\n"
            "rmse target.depth @blind [m]      1.20\n"
            "rmse target.depth @seeing [m]     0.00400\n");
}

TEST(ComparisonTable, SmallNumbersKeepTheirDigits) {
  RunResult result;
  result.estimators = {Named("a", {{"nees.mean:target", 3.21e-6}}),
                       Named("b", {{"nees.mean:target", 4.5e-6}})};
  EXPECT_NE(ComparisonTable(result).find("NEES target    3.21e-06    4.50e-06\n"),
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

// Three errors come first, then two rows of each other metric, in the order of the config. The
// third NIS and most shares inside the 95 % region are left out, because there are nine rows.
TEST(MainKeys, AreTheMostRelevantOnes) {
  EstimatorResult ekf = Named("ekf", {});
  for (const char* block : {"cam.heading", "cam.position", "cam.velocity", "cam.pixel"}) {
    for (const char* kind : {"rmse:", "coverage95:", "lag_ms:"}) {
      ekf.metrics[kind + std::string(block)] = 0.5;
      ekf.metrics[kind + std::string(block) + "@blind"] = 0.5;
    }
  }
  for (const char* sensor : {"left", "right", "top"}) {
    ekf.metrics[std::string("nis.mean:") + sensor] = 0.5;
  }
  ekf.metrics["nees.mean:cam"] = 0.5;
  ekf.counts = {{"accepted:left", 3}, {"accepted:right", 4}, {"gated:left", 1}};
  RunResult result;
  result.estimators = {ekf};
  const std::vector<std::string> subjects = {"cam.position", "cam",   "cam.heading", "cam.velocity",
                                             "cam.pixel",    "right", "left",        "top"};
  EXPECT_EQ(
      internal::MainKeys(result, subjects),
      (std::vector<std::string>{"rmse:cam.position", "rmse:cam.heading", "rmse:cam.velocity",
                                "nees.mean:cam", "nis.mean:right", "nis.mean:left",
                                "accepted:right", "accepted:left", "coverage95:cam.position"}));
}

// A clock offset is a constant: its error at the end matters, not its RMSE.
TEST(MainKeys, HaveTheFinalErrorOfAStateOfASensor) {
  EstimatorResult ekf = Named("ekf", {{"rmse:cam.position", 0.5},
                                      {"rmse:camera.time_offset", 0.5},
                                      {"final_error:cam.position", 0.5},
                                      {"final_error:camera.time_offset", 0.5}});
  ekf.sensors = {"camera"};
  RunResult result;
  result.estimators = {ekf};
  EXPECT_EQ(internal::MainKeys(result, {"cam.position", "camera.time_offset"}),
            (std::vector<std::string>{"rmse:cam.position", "final_error:camera.time_offset"}));
}

TEST(MainTable, CountsUsedMeasurementsAndOmittedRows) {
  RunResult result;
  result.estimators = {Named("ekf", {{"rmse:target.depth", 0.5}, {"lag_ms:target.depth", 1.0}})};
  result.estimators[0].counts = {
      {"accepted:stereo", 5600}, {"initialised:stereo", 34}, {"gated:stereo", 12}};
  EXPECT_EQ(internal::MainTable(result, {"accepted:stereo", "rmse:target.depth"}, 100, 20),
            "                                ekf\n"
            "verdict                  not tested\n"
            "used / given stereo     5,634/5,646\n"
            "rmse target.depth [mm]          500\n\n"
            "3 more rows: --all\n");
}

TEST(MainTable, HasTheEstimatorsAsRowsIfThisIsShorter) {
  RunResult result;
  std::vector<std::string> keys;
  for (const char* block : {"a", "b", "c", "d", "e", "f"}) {
    keys.push_back(std::string("rmse:") + block);
  }
  for (int i = 0; i < 6; ++i) {
    EstimatorResult& estimator = result.estimators.emplace_back();
    estimator.name = "estimator_" + std::to_string(i);
    for (const std::string& key : keys) estimator.metrics[key] = 1.0 + i;
  }
  const std::string wide = internal::MainTable(result, keys, 200, 20);
  EXPECT_NE(wide.find("\nrmse f "), std::string::npos) << wide;
  const std::string narrow = internal::MainTable(result, keys, 60, 20);
  EXPECT_NE(narrow.find("\nestimator_5  not tested    6.00    6.00"), std::string::npos) << narrow;
}

TEST(MainTable, OmitsTheLastRowsIfTheLinesAreFew) {
  RunResult result;
  std::vector<std::string> keys;
  result.estimators = {Named("ekf", {})};
  for (const char* block : {"a", "b", "c", "d", "e", "f"}) {
    keys.push_back(std::string("rmse:") + block);
    result.estimators[0].metrics[keys.back()] = 1.0;
  }
  result.estimators.push_back(result.estimators[0]);
  const std::string table = internal::MainTable(result, keys, 30, 7);
  EXPECT_LE(std::ranges::count(table, '\n'), 7) << table;
  EXPECT_NE(table.find("more rows: --all\n"), std::string::npos) << table;
}

TEST(ComparisonTable, MarksWhatExplainsABadVerdict) {
  RunResult result;
  result.estimators = {Named(
      "ekf", {{"nees.mean:target", 5.0}, {"nees.low:target", 0.8}, {"nees.high:target", 1.2}})};
  result.estimators[0].verdict.state = VerdictState::kConsistent;
  EXPECT_EQ(ComparisonTable(result).find('!'), std::string::npos);
  result.estimators[0].verdict.state = VerdictState::kOverconfident;
  EXPECT_NE(ComparisonTable(result).find("5.00 !\n"), std::string::npos);
  result.estimators[0].metrics["nees.mean:target"] = 1.1;
  EXPECT_EQ(ComparisonTable(result).find('!'), std::string::npos);
}

TEST(ComparisonTable, HasAnglesInDegrees) {
  RunResult result;
  result.estimators = {Named("ekf", {{"rmse:cam.heading", 0.0174533}})};
  EXPECT_NE(ComparisonTable(result).find("rmse cam.heading [deg]"), std::string::npos);
  EXPECT_NE(ComparisonTable(result).find("1.00\n"), std::string::npos);
  EXPECT_EQ(internal::ValueText("rmse:cam.rate", 0.1, "rad/s"), "5.73 deg/s");
}

TEST(ComparisonTable, LabelsACountWithoutASubjectByItsName) {
  RunResult result;
  result.estimators = {Named("ekf", {})};
  result.estimators[0].counts = {{"landmarks.deleted", 3}, {"accepted:stereo", 7}};
  const std::vector<internal::TableRow> rows = internal::ComparisonRows(result);
  ASSERT_EQ(rows.size(), 3u);
  EXPECT_EQ(rows[1].label, "accepted stereo");
  EXPECT_EQ(rows[2].label, "landmarks.deleted");
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
