// SPDX-License-Identifier: Apache-2.0
//
// Runs examples/14_slam_stereo_tracks on real drives. Checks the final error as a fraction of the
// path length.
#include <cmath>
#include <tuple>

#include "drives.h"

namespace alidade {
namespace {

/// A drive, its number of frames from the first frame of the example, and the length of the true
/// path.
struct Drive {
  const char* name;
  int frames;
  double path_m;
};
constexpr Drive kDrives[] = {
    {"drive_0001", 90, 90.7}, {"drive_0036", 232, 165.8}, {"drive_0095", 132, 121.1}};
constexpr double kMost = 0.03;  // fraction of the path length; a prototype attained 0.013 to 0.019

class SlamStereoTracks : public testing::DrivesTest {
 protected:
  /// Checks for each drive that the final position error is at most kMost times the path length.
  void ExpectExact(const Settings& settings) const {
    for (const Drive& drive : kDrives) {
      const Config config = ConfigOf("14_slam_stereo_tracks", drive.name, drive.frames, settings);
      std::string told = drive.name;
      for (const auto& [key, value] : settings) {
        told += ", " + key + "=" + value;
      }
      const PluginHost host(PluginPaths(config));
      Experiment experiment = BuildExperiment(config, host);
      const RunResult run = alidade::Run(experiment, {});
      EXPECT_EQ(run.status, RunStatus::kOk) << told << ": " << run.reason;
      EXPECT_EQ(run.frames, drive.frames) << told;
      const EstimatorResult& ekf = run.estimators.at(0);
      EXPECT_LE(ekf.metrics.at("final_error:cam.position"), kMost * drive.path_m) << told;
      EXPECT_FALSE(ekf.diverged) << told;
      EXPECT_FALSE(settings.empty() && ekf.verdict.state == VerdictState::kLost) << told;
    }
  }
};

TEST_F(SlamStereoTracks, EndWithinThreePercentOfThePath) { ExpectExact({}); }

TEST_F(SlamStereoTracks, DoNotHangOnNoiseGateOrMoreFeatures) {
  const Settings others = {{"sensors.stereo.sigma_px", "2"},
                           {"landmarks.max_per_frame", "200"},
                           {"estimators.ekf.gate", "0.9"},
                           {"sensors.stereo.sigma_px", "5"},
                           {"state.cam.noise.linear_acceleration", "4"}};
  for (const auto& other : others) ExpectExact({other});
}

TEST_F(SlamStereoTracks, AreThoseOfTheirOwnCamera) {
  for (const auto& [key, other, own] : {std::tuple("camera.fx", "707.0912", "721.5377"),
                                        std::tuple("camera.baseline_m", "0.54", "0.537150")}) {
    const Config config = ConfigOf("14_slam_stereo_tracks", "drive_0036", 5, {{key, other}});
    const PluginHost host(PluginPaths(config));
    try {
      BuildExperiment(config, host);
      FAIL() << key;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ExitCode::kBadConfig);
      const std::string words =
          std::string(key) + ": " + other + " differs from the calibration of the data, " + own;
      EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
    }
  }
}

}  // namespace
}  // namespace alidade
