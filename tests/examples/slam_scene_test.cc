// SPDX-License-Identifier: Apache-2.0
//
// Compares examples/10_slam_scene with the numbers in its README.
#include <gtest/gtest.h>

#include <filesystem>

#include "alidade/sweep/sweep.h"

namespace alidade {
namespace {

const std::filesystem::path kFolder =
    std::filesystem::path(ALIDADE_SOURCE_DIR) / "examples" / "10_slam_scene";

using Settings = std::vector<std::pair<std::string, std::string>>;

/// Returns the summary of the seeds 1001 to 1020.
SweepSummary Twenty(const std::string& name, const Settings& settings = {}) {
  Config config = Config::FromFile(kFolder / name);
  for (const auto& [key, value] : settings) config.Set(key, value, "--set");
  const PluginHost host(PluginPaths(config));
  SweepOptions options;
  options.runs = 20;
  options.first_seed = 1001;
  const SweepResult result = Sweep(config, host, options);
  for (const SweepRun& run : result.done) EXPECT_EQ(run.status, RunStatus::kOk) << run.reason;
  return Summarise(result).at(0);
}

/// Checks that a filter is consistent on these scenes.
void ExpectHonest(const SweepSummary& ekf) {
  EXPECT_EQ(ekf.diverged + ekf.CountOf(VerdictState::kLost), 0);
  EXPECT_EQ(ekf.used, 20);
  EXPECT_GE(ekf.metrics.at("nees.mean:cam").mean, 0.7);
  EXPECT_LE(ekf.metrics.at("nees.mean:cam").mean, 1.6);
  EXPECT_GE(ekf.metrics.at("nees.within95:cam").mean, 0.80);
  EXPECT_GE(ekf.metrics.at("nis.mean:pixels").mean, 0.95);
  EXPECT_LE(ekf.metrics.at("nis.mean:pixels").mean, 1.05);
  EXPECT_NEAR(ekf.metrics.at("map.sim3.scale").mean, 1.0, 0.003);
}

TEST(SlamScene, IsExactAndHonestOnAPathDrawnFromTheModel) {
  const SweepSummary ekf = Twenty("config.yaml");
  ExpectHonest(ekf);
  EXPECT_LE(ekf.metrics.at("final_error:cam.position").mean, 0.013);
  EXPECT_LE(ekf.metrics.at("map.sim3.rmse").mean, 0.0075);
}

TEST(SlamScene, IsExactAndHonestOnASidewaysSweep) {
  const SweepSummary ekf = Twenty("sweep.yaml");
  ExpectHonest(ekf);
  EXPECT_LE(ekf.metrics.at("final_error:cam.position").mean, 0.022);
  EXPECT_LE(ekf.metrics.at("map.sim3.rmse").mean, 0.010);
}

TEST(SlamScene, IsHonestAtOtherNoise) {
  for (const char* noise : {"0.5", "2"}) {
    const Settings settings{{"source.sigma_px", noise},
                            {"sensors.pixels.sigma_px", noise},
                            {"sensors.known.sigma_px", noise}};
    for (const char* name : {"config.yaml", "sweep.yaml"}) {
      SCOPED_TRACE(std::string(name) + ", " + noise + " px");
      ExpectHonest(Twenty(name, settings));
    }
  }
}

TEST(SlamScene, WithoutNoiseTheMapIsExactButForLinearisation) {
  const SweepSummary ekf = Twenty("config.yaml", {{"source.sigma_px", "0"}});
  EXPECT_EQ(ekf.diverged + ekf.CountOf(VerdictState::kLost), 0);
  EXPECT_LE(ekf.metrics.at("final_error:cam.position").mean, 0.005);
  EXPECT_LE(ekf.metrics.at("map.sim3.rmse").mean, 0.0025);
  EXPECT_LE(ekf.metrics.at("nis.mean:pixels").mean, 0.05);
}

// Without delayed initialisation, 3 of these 20 runs are lost (docs/why_filters_fail.md).
TEST(SlamScene, WhoseMotionIsSlowKeepsItsDepthWhereLandmarksWaitForTheMotion) {
  const SweepSummary waits = Twenty("slow_sweep.yaml");
  EXPECT_EQ(waits.diverged + waits.CountOf(VerdictState::kLost), 0);
  EXPECT_NEAR(waits.metrics.at("map.sim3.scale").mean, 1.0, 0.01);
  EXPECT_LE(waits.metrics.at("rmse:cam.position").mean, 0.03);
  EXPECT_GE(Twenty("slow_sweep.yaml", {{"landmarks.prior.min_observations", "1"}})
                .CountOf(VerdictState::kLost),
            1);
}

// The priors of 36 points are wrong: the inverse distance is 1.25 times the truth. NEES shows this,
// but NIS does not.
TEST(SlamScene, ManyWrongPriorsShowInNeesAndNotInNis) {
  const SweepSummary ekf =
      Twenty("config.yaml", {{"landmarks.prior", "{inverse_distance: 0.49, sigma: 0.11}"}});
  EXPECT_GE(ekf.metrics.at("nees.mean:cam").mean, 2.0);
  EXPECT_GE(ekf.metrics.at("nis.mean:pixels").mean, 0.95);
  EXPECT_LE(ekf.metrics.at("nis.mean:pixels").mean, 1.05);
}

// If no depth is known, the same prior makes the trajectory and the map too small by the same
// factor. The map keeps its shape.
TEST(SlamScene, ScaleIsThePriorsWhereNoDepthIsKnown) {
  const SweepSummary ekf =
      Twenty("config.yaml", {{"estimators.ekf.sensors", "[pixels]"},
                             {"landmarks.prior", "{inverse_distance: 0.43, sigma: 0.1}"}});
  EXPECT_EQ(ekf.diverged + ekf.CountOf(VerdictState::kLost), 0);
  EXPECT_NEAR(ekf.metrics.at("map.sim3.scale").mean, 0.43 / 0.39, 0.03);
  EXPECT_LE(ekf.metrics.at("map.sim3.rmse").mean, 0.0075);
  EXPECT_GE(ekf.metrics.at("nees.mean:cam").mean, 3.0);
  EXPECT_NEAR(ekf.metrics.at("nis.mean:pixels").mean, 1.0, 0.05);
}

}  // namespace
}  // namespace alidade
