// SPDX-License-Identifier: Apache-2.0
//
// Compares the trajectory and the map of the batch with those of the filter. Uses
// examples/10_slam_scene and examples/13_slam_odometry_tracks.
#include <filesystem>

#include "alidade/sweep/sweep.h"
#include "drives.h"

namespace alidade {
namespace {

/// Summaries of the filter and of the batch over the seeds 1001 to 1008, both with the same config
/// of example 10.
struct Pair {
  SweepSummary ekf, batch;
  double Ratio(const char* key) const {
    return ekf.metrics.at(key).mean / batch.metrics.at(key).mean;
  }
};
Pair Eight(const char* name) {
  const Config config = Config::FromFile(std::filesystem::path(ALIDADE_SOURCE_DIR) / "examples" /
                                         "10_slam_scene" / name);
  const PluginHost host(PluginPaths(config));
  SweepOptions options;
  options.runs = 8;
  options.first_seed = 1001;
  const SweepResult result = Sweep(config, host, options);
  for (const SweepRun& run : result.done) EXPECT_EQ(run.status, RunStatus::kOk) << run.reason;
  const std::vector<SweepSummary> summaries = Summarise(result);
  EXPECT_EQ(summaries.at(1).diverged, 0);
  return {summaries.at(0), summaries.at(1)};
}

// The model generates the trajectory, so the batch is consistent. The NEES covers the whole
// trajectory.
TEST(CeresBatchSlam, IsHonestOnAPathDrawnFromTheModelAndItsMapIsLittleBetterThanTheFilters) {
  const Pair pair = Eight("batch.yaml");
  EXPECT_NEAR(pair.batch.metrics.at("nees.mean:cam").mean, 1.0, 0.25);
  EXPECT_GE(pair.batch.metrics.at("nees.within95:cam").mean, 0.85);
  EXPECT_LE(pair.Ratio("map.sim3.rmse"), 1.10);
  EXPECT_GE(pair.Ratio("map.sim3.rmse"), 1.0);
  EXPECT_GE(pair.Ratio("final_error:cam.position"), 1.0);
  EXPECT_GE(pair.Ratio("rmse:cam.position"), 1.5);  // the batch smooths the trajectory
}

TEST(CeresBatchSlam, IsBetterThanTheFilterOnASidewaysSweep) {
  const Pair pair = Eight("sweep_batch.yaml");
  EXPECT_LE(pair.Ratio("map.sim3.rmse"), 1.10);
  EXPECT_GE(pair.Ratio("final_error:cam.position"), 1.0);
  EXPECT_GE(pair.Ratio("rmse:cam.position"), 2.0);
}

class CeresBatchSlamDrives : public testing::DrivesTest {};

// `most` is the RMS error, in m, of the position over the first `frames` frames. An independent
// batch attained this error.
TEST_F(CeresBatchSlamDrives, StaysWithinThePublishedErrorsWithARobustLoss) {
  const struct {
    const char* name;
    int frames;
    double most;
  } drives[] = {{"drive_0001", 98, 0.45}, {"drive_0036", 240, 1.15}, {"drive_0095", 140, 1.56}};
  const std::string batch =
      "{type: ceres_batch, overrides: {sensors: {pixels: {loss: {cauchy: 1}}}}}";
  for (const auto& drive : drives) {
    const Config config = ConfigOf("13_slam_odometry_tracks", drive.name, drive.frames,
                                   {{"estimators", "{batch: " + batch + "}"}});
    const PluginHost host(PluginPaths(config));
    Experiment experiment = BuildExperiment(config, host);
    const RunResult run = alidade::Run(experiment, {});
    ASSERT_EQ(run.status, RunStatus::kOk) << run.reason;
    EXPECT_LE(run.estimators.at(0).metrics.at("rmse:cam.position"), drive.most) << drive.name;
  }
}

}  // namespace
}  // namespace alidade
