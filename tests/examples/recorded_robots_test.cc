// SPDX-License-Identifier: Apache-2.0
//
// Runs the examples 36 and 37 on the recordings of their robots.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <numbers>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "alidade/experiment/run.h"
#include "support/temporary_folder.h"

namespace alidade {
namespace {

namespace fs = std::filesystem;

class RecordedRobots : public ::testing::Test {
 protected:
  static fs::path FolderOf(const std::string& recording) {
    const char* const data = std::getenv("ALIDADE_DATA");
    return fs::path(data ? data : "/none") / recording;
  }
  /// Runs an example on the recording in a folder of ALIDADE_DATA.
  static void RunOn(const std::string& example, const std::string& recording, RunResult& run) {
    if (!fs::is_directory(FolderOf(recording))) {
      GTEST_SKIP() << "ALIDADE_DATA does not contain " << recording;
    }
    RunIn(example, FolderOf(recording), {}, run);
  }
  /// Runs an example on the recording in `folder`, with further settings of the config.
  static void RunIn(const std::string& example, const fs::path& folder,
                    const std::vector<std::pair<std::string, std::string>>& settings,
                    RunResult& run) {
    Config config =
        Config::FromFile(fs::path(ALIDADE_SOURCE_DIR) / "examples" / example / "config.yaml");
    config.Set("source.path", folder.string(), "--set");
    for (const auto& [key, value] : settings) config.Set(key, value, "--set");
    const PluginHost host(std::vector<std::filesystem::path>{});
    Experiment experiment = BuildExperiment(config, host);
    run = alidade::Run(experiment, {});
    ASSERT_EQ(run.status, RunStatus::kOk) << run.reason;
  }
  static const EstimatorResult& Named(const RunResult& run, const std::string& name) {
    for (const EstimatorResult& estimator : run.estimators) {
      if (estimator.name == name) return estimator;
    }
    throw std::out_of_range(name);
  }
};

TEST_F(RecordedRobots, ARobotIsComposedFromItsRawFiles) {
  RunResult run;
  RunOn("36_robot_from_files", "newcomer-robot", run);
  if (IsSkipped()) return;
  const EstimatorResult &ekf = Named(run, "ekf"), &rts = Named(run, "rts");
  EXPECT_LE(ekf.metrics.at("rmse:robot.position"), 0.20);
  EXPECT_LE(rts.metrics.at("rmse:robot.position"), 0.125);
  EXPECT_NE(ekf.verdict.state, VerdictState::kLost);
  EXPECT_NEAR(ekf.metrics.at("nees.mean:robot"), 0.85, 0.05 * 0.85);
  EXPECT_NEAR(rts.metrics.at("nees.mean:robot"), 0.74, 0.05 * 0.74);
  // The large outliers among the 121 fixes are rejected, and nothing else.
  EXPECT_EQ(ekf.counts.at("gated:gps"), 4);
  EXPECT_EQ(ekf.counts.at("accepted:gps"), 117);
}

TEST_F(RecordedRobots, ARobotAmongRadioBeaconsEstimatesTheirBiases) {
  RunResult run;
  RunOn("37_plaza_ranges", "plaza2", run);
  if (IsSkipped()) return;
  const EstimatorResult& ekf = Named(run, "ekf");
  EXPECT_LE(ekf.metrics.at("rmse:robot.position"), 1.05 * 0.79);
  EXPECT_LE(ekf.metrics.at("rmse:robot.heading"), 1.05 * 2.7 * std::numbers::pi / 180.0);
  EXPECT_NEAR(ekf.metrics.at("nees.mean:robot"), 1.04, 0.05 * 1.04);
  EXPECT_LE(Named(run, "rts").metrics.at("rmse:robot.position"), 1.05 * 0.56);
  EXPECT_NEAR(Named(run, "odometry").metrics.at("rmse:robot.position"), 31.7, 1.0);
  for (const char* name : {"ekf", "rts"}) {
    EXPECT_NE(Named(run, name).verdict.state, VerdictState::kLost) << name;
    EXPECT_FALSE(Named(run, name).diverged) << name;
  }
}

/// Copies the rows of a table from `start_s` on, with other numbers of the beacons. Returns
/// the first row that was copied.
std::vector<std::string> CopyFrom(double start_s, const fs::path& from, const fs::path& to) {
  const std::map<std::string, std::string> ids = {{"0", "17"}, {"1", "3"}, {"5", "0"}, {"6", "42"}};
  std::ifstream in(from);
  std::ofstream out(to);
  std::vector<std::string> first;
  std::string line, cell;
  std::getline(in, line);
  out << line << '\n';
  std::istringstream header(line);
  std::size_t beacon = 100, column = 0;
  for (; std::getline(header, cell, ','); ++column) {
    if (cell == "beacon") beacon = column;
  }
  while (std::getline(in, line)) {
    std::vector<std::string> cells;
    for (std::istringstream row(line); std::getline(row, cell, ',');) {
      cells.push_back(cells.size() == beacon ? ids.at(cell) : cell);
    }
    if (beacon != 0 && std::stod(cells[0]) < start_s) continue;
    for (std::size_t i = 0; i < cells.size(); ++i) out << (i > 0 ? "," : "") << cells[i];
    out << '\n';
    if (first.empty()) first = cells;
  }
  return first;
}

// Another recording of the kind: it begins 200 s later, and its beacons have other numbers.
TEST_F(RecordedRobots, TheBeaconsOfAnotherRecordingHaveOtherNumbers) {
  const fs::path recording = FolderOf("plaza2");
  if (!fs::is_directory(recording)) GTEST_SKIP() << "ALIDADE_DATA does not contain plaza2";
  const testing::TemporaryFolder folder;
  for (const char* file : {"beacons.csv", "odometry.csv", "ranges.csv"}) {
    CopyFrom(3352.0, recording / file, folder / file);
  }
  const std::vector<std::string> start =
      CopyFrom(3352.0, recording / "groundtruth.csv", folder / "groundtruth.csv");
  const double heading = std::stod(start[3]) + std::numbers::pi;
  RunResult run;
  RunIn("37_plaza_ranges", folder.path(),
        {{"state.robot.initial.position.mean", '[' + start[1] + ", " + start[2] + ']'},
         {"state.robot.initial.heading.mean", std::to_string(heading)}},
        run);
  const EstimatorResult& ekf = Named(run, "ekf");
  EXPECT_LE(ekf.metrics.at("rmse:robot.position"), 1.05);
  EXPECT_NE(ekf.verdict.state, VerdictState::kLost);
  for (const char* beacon : {"beacon_17", "beacon_3", "beacon_0", "beacon_42"}) {
    EXPECT_GT(ekf.counts.at(std::string("accepted:") + beacon), 50) << beacon;
    EXPECT_FALSE(ekf.counts.contains(std::string("gated:") + beacon)) << beacon;
  }
}

}  // namespace
}  // namespace alidade
