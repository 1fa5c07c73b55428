// SPDX-License-Identifier: Apache-2.0
//
// Tests examples/27_slam_inverse_depth_prior. A prior of 1 /m is correct for points about 1 m away.
// For points at other distances this prior leads to a wrong scale.
#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "alidade/sweep/sweep.h"

namespace alidade {
namespace {

/// Returns the summary of the seeds 1001 to 1008.
SweepSummary EightWithPrior(const std::string& file, const std::string& prior) {
  Config config = Config::FromFile(std::filesystem::path(ALIDADE_SOURCE_DIR) /
                                   "examples/27_slam_inverse_depth_prior" / file);
  config.Set("landmarks.prior", prior, "--set");
  const PluginHost host(PluginPaths(config));
  SweepOptions options;
  options.runs = 8;
  options.first_seed = 1001;
  SweepSummary ekf = Summarise(Sweep(config, host, options)).at(0);
  EXPECT_EQ(ekf.used, 8);
  EXPECT_EQ(ekf.diverged, 0);
  return ekf;
}

const std::string kOne = "{inverse_distance: 1, sigma: 0.23}";

TEST(SlamInverseDepthPrior, OneIsRightAboutOneMetreAway) {
  const SweepSummary near = EightWithPrior("config.yaml", kOne);
  EXPECT_EQ(near.CountOf(VerdictState::kLost), 0);
  EXPECT_NEAR(near.metrics.at("map.sim3.scale").mean, 1.0, 0.05);
  EXPECT_LE(near.metrics.at("rmse:cam.position").mean, 0.02);
  EXPECT_LE(near.metrics.at("nees.mean:cam").mean, 2.0);
}

// One scene is 1 / 0.39 times as large as the other. Both scenes produce the same pixels, so the
// estimates are the same.
TEST(SlamInverseDepthPrior, TheSameFilterMakesTheSameMapOfALargerScene) {
  const double larger = 1.0 / 0.39;
  const SweepSummary near = EightWithPrior("config.yaml", kOne);
  const SweepSummary far = EightWithPrior("far.yaml", kOne);
  const auto ratio = [&](const char* key) {
    return far.metrics.at(key).mean / near.metrics.at(key).mean;
  };
  EXPECT_NEAR(ratio("map.sim3.scale"), larger, 1e-6 * larger);
  EXPECT_NEAR(ratio("map.sim3.rmse"), larger, 1e-6 * larger);
  EXPECT_NEAR(ratio("nis.mean:pixels"), 1.0, 1e-9);
  EXPECT_NEAR(ratio("reprojection:pixels"), 1.0, 1e-9);
  EXPECT_EQ(far.CountOf(VerdictState::kLost), 8);
  EXPECT_GE(far.metrics.at("nees.mean:cam").mean, 100.0);
}

TEST(SlamInverseDepthPrior, ScaleFollowsThePriorAndTheShapeStays) {
  const SweepSummary right = EightWithPrior("config.yaml", kOne);
  const SweepSummary low = EightWithPrior("config.yaml", "{inverse_distance: 0.39, sigma: 0.09}");
  EXPECT_LE(low.metrics.at("map.sim3.scale").mean, 0.55);
  EXPECT_NEAR(low.metrics.at("map.sim3.rmse").mean, right.metrics.at("map.sim3.rmse").mean, 0.001);
  EXPECT_NEAR(low.metrics.at("nis.mean:pixels").mean, 1.0, 0.1);
  EXPECT_EQ(low.CountOf(VerdictState::kLost), 8);
}

}  // namespace
}  // namespace alidade
