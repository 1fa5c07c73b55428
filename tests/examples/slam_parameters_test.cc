// SPDX-License-Identifier: Apache-2.0
//
// Checks the claims about parameters in the README of examples/12_slam_parameters.
#include <gtest/gtest.h>

#include <filesystem>

#include "alidade/sweep/sweep.h"

namespace alidade {
namespace {

/// Returns the summary of ten seeds, 1001 to 1010, with one key changed.
SweepSummary Ten(const std::string& key, const std::string& value) {
  Config config = Config::FromFile(std::filesystem::path(ALIDADE_SOURCE_DIR) /
                                   "examples/12_slam_parameters/config.yaml");
  config.Set(key, value, "--set");
  const PluginHost host(PluginPaths(config));
  SweepOptions options;
  options.runs = 10;
  options.first_seed = 1001;
  return Summarise(Sweep(config, host, options)).at(0);
}

double Mean(const SweepSummary& ekf, const char* metric) { return ekf.metrics.at(metric).mean; }

TEST(SlamParameters, VagueInitialVelocitiesCostLittle) {
  for (const char* key :
       {"state.cam.initial.velocity.sigma", "state.cam.initial.angular_velocity.sigma"}) {
    const SweepSummary ekf = Ten(key, "1");
    EXPECT_EQ(ekf.diverged + ekf.CountOf(VerdictState::kLost), 0) << key;
    EXPECT_LE(Mean(ekf, "final_error:cam.position"), 0.012) << key;
    EXPECT_LE(Mean(ekf, "nees.mean:cam"), 1.3) << key;
  }
}

// An assumed noise that is too small does more harm than an assumed noise that is ten times too
// large.
TEST(SlamParameters, TooLittleNoiseMakesTheFilterOverconfident) {
  const auto nees = [](const char* key, const char* value) {
    return Mean(Ten(key, value), "nees.mean:cam");
  };
  EXPECT_GE(nees("state.cam.noise.linear_acceleration", "0.1"), 2.0);
  EXPECT_LE(nees("state.cam.noise.linear_acceleration", "3"), 1.3);
  EXPECT_GE(nees("state.cam.noise.angular_acceleration", "0.015"), 2.0);
  EXPECT_LE(nees("state.cam.noise.angular_acceleration", "0.5"), 1.3);
  EXPECT_GE(Ten("sensors.pixels.sigma_px", "0.25").CountOf(VerdictState::kLost), 8);
  EXPECT_LE(nees("sensors.pixels.sigma_px", "4"), 1.0);
}

TEST(SlamParameters, ThePriorOfTheInverseDepthHasToFitTheScene) {
  const std::string key = "landmarks.prior.inverse_distance";
  EXPECT_LE(Mean(Ten(key, "0.35"), "nees.mean:cam"), 1.4);
  EXPECT_GE(Ten(key, "1").CountOf(VerdictState::kLost), 8);
  EXPECT_GE(Mean(Ten("landmarks.prior.sigma", "0.15"), "nees.mean:cam"), 1.7);
}

TEST(SlamParameters, ALongerFocalLengthIsNotBetter) {
  const SweepSummary far =
      Ten("camera", "{width: 640, height: 480, fx: 2100, fy: 2100, cx: 320, cy: 240}");
  const SweepSummary near =
      Ten("camera", "{width: 640, height: 480, fx: 525, fy: 525, cx: 320, cy: 240}");
  EXPECT_GE(Mean(far, "final_error:cam.position"), 3.0 * Mean(near, "final_error:cam.position"));
}

}  // namespace
}  // namespace alidade
