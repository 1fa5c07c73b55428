// SPDX-License-Identifier: Apache-2.0
//
// examples/11_slam_reprojection and the scenes of 10, held against the claim of 2015: after its
// initial peak the reprojection error settles in a number of frames that noise does not change.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "alidade/sweep/sweep.h"

namespace alidade {
namespace {

const std::filesystem::path kExamples = std::filesystem::path(ALIDADE_SOURCE_DIR) / "examples";

/// Seeds 1001 to 1020 with this noise, which the filter knows.
SweepSummary Twenty(const std::string& name, const std::string& noise_px) {
  Config config = Config::FromFile(kExamples / name);
  for (const char* key : {"source.noise_px", "sensors.pixels.sigma_px", "sensors.known.sigma_px"}) {
    config.Set(key, noise_px, "--set");
  }
  const PluginHost host(PluginPaths(config));
  SweepOptions options;
  options.runs = 20;
  options.first_seed = 1001;
  return Summarise(Sweep(config, host, options)).at(0);
}

TEST(SlamReprojection, SettlesInAsManyFramesWhateverTheNoise) {
  for (const char* name : {"11_slam_reprojection/config.yaml", "10_slam_scene/config.yaml",
                           "10_slam_scene/sweep.yaml"}) {
    SCOPED_TRACE(name);
    double least = 1e9, most = 0.0;
    for (const auto& [noise_px, level_px] : {std::pair("0.5", 0.5), {"1", 1.0}, {"2", 2.0}}) {
      const SweepSummary ekf = Twenty(name, noise_px);
      EXPECT_EQ(ekf.used, 20);
      const Spread frames = ekf.metrics.at("settling_frames:pixels");
      EXPECT_LE(frames.p95, 20.0) << noise_px;
      least = std::min(least, frames.mean);
      most = std::max(most, frames.mean);
      // The innovation is the noise, and a little of what the prediction is off.
      EXPECT_NEAR(ekf.metrics.at("reprojection:pixels").mean, 1.03 * level_px, 0.04 * level_px);
    }
    EXPECT_LE(most - least, 5.0);
  }
}

}  // namespace
}  // namespace alidade
