// SPDX-License-Identifier: Apache-2.0
//
// Runs examples/13_slam_odometry_tracks on real drives. Compares the errors with those of a
// published filter and of dead reckoning.
#include <cmath>

#include "drives.h"

namespace alidade {
namespace {

/// A drive, its number of frames, and three RMS errors of the position in m. `dead_reckoning` and
/// `published` (a sliding window over 10 frames) are published errors; `most` is the limit of this
/// test.
struct Drive {
  const char* name;
  int frames;
  double dead_reckoning, published, most;
};
constexpr Drive kDrives[] = {{"drive_0001", 98, 1.357, 0.618, 0.50},
                             {"drive_0036", 240, 1.151, 0.879, 0.95},
                             {"drive_0095", 140, 2.132, 1.433, 1.62}};

class SlamOdometryTracks : public testing::DrivesTest {
 protected:
  /// Returns the RMS error of the position in m.
  double Error(const Drive& drive, const Settings& settings = {}) const {
    return Ekf(drive, settings).metrics.at("rmse:cam.position");
  }
  EstimatorResult Ekf(const Drive& drive, const Settings& settings = {}) const {
    const Config config = ConfigOf("13_slam_odometry_tracks", drive.name, drive.frames, settings);
    const PluginHost host(PluginPaths(config));
    Experiment experiment = BuildExperiment(config, host);
    const RunResult run = alidade::Run(experiment, {});
    EXPECT_EQ(run.status, RunStatus::kOk) << run.reason;
    EXPECT_EQ(run.frames, drive.frames);
    return run.estimators.at(0);
  }
};

TEST_F(SlamOdometryTracks, IsBetterThanDeadReckoningAndThePublishedFilter) {
  double log_ratio = 0.0;
  for (const Drive& drive : kDrives) {
    const double error = Error(drive);
    EXPECT_LE(error, drive.most) << drive.name;
    EXPECT_LE(error, 0.80 * drive.dead_reckoning) << drive.name;
    log_ratio += std::log(error / drive.published) / 3.0;
  }
  EXPECT_LE(std::exp(log_ratio), 0.90);
}

// The truth jitters by 0.035 m, which does not make a filter lost. In drive 0095 the odometry has
// a speed error of 1.6 %. The filter does not model a speed error, so it is lost.
TEST_F(SlamOdometryTracks, IsInconsistentOnlyWhereTheOdometryIs) {
  for (const Drive& drive : kDrives) {
    const EstimatorResult ekf = Ekf(drive);
    EXPECT_EQ(ekf.verdict.state == VerdictState::kLost, std::string(drive.name) == "drive_0095")
        << drive.name;
    EXPECT_FALSE(ekf.diverged) << drive.name;
  }
  EXPECT_TRUE(Ekf(kDrives[0], {{"evaluate.truth_sigma", "{}"}}).verdict.state ==
              VerdictState::kLost);
}

TEST_F(SlamOdometryTracks, DoesNotHangOnTheNoiseOrTheNumberOfFeatures) {
  const Settings others = {{"sensors.pixels.sigma_px", "1"},
                           {"sensors.pixels.sigma_px", "4"},
                           {"landmarks.max_per_frame", "30"},
                           {"landmarks.max_per_frame", "200"},
                           {"landmarks.representation", "anchored"},
                           {"landmarks.convert_to_xyz.max_linearity_index", "0.1"}};
  for (const auto& other : others) {
    for (const Drive& drive : kDrives) {
      const EstimatorResult ekf = Ekf(drive, {other});
      EXPECT_LE(ekf.metrics.at("rmse:cam.position"), drive.most)
          << drive.name << ' ' << other.first;
      EXPECT_FALSE(ekf.diverged) << drive.name << ' ' << other.first;
    }
  }
}

}  // namespace
}  // namespace alidade
