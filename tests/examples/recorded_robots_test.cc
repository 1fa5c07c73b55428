// SPDX-License-Identifier: Apache-2.0
//
// Runs the examples 36 and 37 on the recordings of their robots.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <string>

#include "alidade/experiment/run.h"

namespace alidade {
namespace {

class RecordedRobots : public ::testing::Test {
 protected:
  /// Runs an example on the recording in a folder of ALIDADE_DATA.
  static void RunOn(const std::string& example, const std::string& recording, RunResult& run) {
    const char* const data = std::getenv("ALIDADE_DATA");
    const std::filesystem::path folder = std::filesystem::path(data ? data : "") / recording;
    if (data == nullptr || !std::filesystem::is_directory(folder)) {
      GTEST_SKIP() << "ALIDADE_DATA does not contain " << recording;
    }
    Config config = Config::FromFile(std::filesystem::path(ALIDADE_SOURCE_DIR) / "examples" /
                                     example / "config.yaml");
    config.Set("source.path", folder.string(), "--set");
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
  // The large outliers among the 121 fixes are rejected, and nothing else.
  EXPECT_EQ(ekf.counts.at("gated:gps"), 4);
  EXPECT_EQ(ekf.counts.at("accepted:gps"), 117);
}

TEST_F(RecordedRobots, ARobotAmongRadioBeaconsEstimatesTheirBiases) {
  RunResult run;
  RunOn("37_plaza_ranges", "plaza2", run);
  if (IsSkipped()) return;
  const EstimatorResult& ekf = Named(run, "ekf");
  EXPECT_LE(ekf.metrics.at("rmse:robot.position"), 1.05);
  EXPECT_NEAR(Named(run, "odometry").metrics.at("rmse:robot.position"), 31.7, 1.0);
  for (const char* name : {"ekf", "rts"}) {
    EXPECT_NE(Named(run, name).verdict.state, VerdictState::kLost) << name;
    EXPECT_FALSE(Named(run, name).diverged) << name;
  }
}

}  // namespace
}  // namespace alidade
