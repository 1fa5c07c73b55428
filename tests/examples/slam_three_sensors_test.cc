// SPDX-License-Identifier: Apache-2.0
//
// Tests examples/26_slam_three_sensors: a single camera, a stereo pair and a depth camera measure
// the same scene.
#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <string>

#include "alidade/sweep/sweep.h"

namespace alidade {
namespace {

/// Returns the summaries of the seeds 1001 to 1008, keyed by estimator.
std::map<std::string, SweepSummary> EightOfThreeSensors(const std::string& file,
                                                        const std::string& key = "",
                                                        const std::string& value = "") {
  Config config = Config::FromFile(std::filesystem::path(ALIDADE_SOURCE_DIR) /
                                   "examples/26_slam_three_sensors" / file);
  if (!key.empty()) config.Set(key, value, "--set");
  const PluginHost host(PluginPaths(config));
  SweepOptions options;
  options.runs = 8;
  options.first_seed = 1001;
  std::map<std::string, SweepSummary> by_name;
  for (SweepSummary& one : Summarise(Sweep(config, host, options))) {
    EXPECT_EQ(one.used, 8) << one.name;
    EXPECT_EQ(one.diverged, 0) << one.name;
    by_name[one.name] = one;
  }
  return by_name;
}

double MeanOf(const SweepSummary& one, const char* key) { return one.metrics.at(key).mean; }

TEST(SlamThreeSensors, OneCameraSeesTheShapeAndNotTheSize) {
  const auto mono = EightOfThreeSensors("config.yaml");
  const auto stereo = EightOfThreeSensors("stereo.yaml");
  const auto depth = EightOfThreeSensors("depth.yaml");
  const SweepSummary &prior = mono.at("mono"), &known = mono.at("mono_known");
  EXPECT_NEAR(MeanOf(prior, "map.sim3.rmse"), MeanOf(known, "map.sim3.rmse"), 0.001);
  EXPECT_GE(MeanOf(prior, "map.rmse"), 5.0 * MeanOf(known, "map.rmse"));
  EXPECT_LE(MeanOf(known, "rmse:cam.position"), 0.012);
  EXPECT_LE(MeanOf(stereo.at("stereo"), "rmse:cam.position"), 0.007);
  EXPECT_LE(MeanOf(depth.at("depth"), "rmse:cam.position"), 0.006);
  EXPECT_LE(MeanOf(depth.at("depth"), "map.rmse"), 0.7 * MeanOf(stereo.at("stereo"), "map.rmse"));
  EXPECT_NEAR(MeanOf(stereo.at("stereo"), "nees.mean:cam"), 1.0, 0.3);
  EXPECT_NEAR(MeanOf(depth.at("depth"), "nees.mean:cam"), 1.0, 0.3);
}

TEST(SlamThreeSensors, ABaselineThatIsTooShortIsWorseThanNone) {
  const auto near = EightOfThreeSensors("stereo.yaml", "camera.baseline_m", "0.01");
  EXPECT_GE(near.at("stereo").CountOf(VerdictState::kLost), 3);
  EXPECT_GE(MeanOf(near.at("stereo"), "rmse:cam.position"), 0.04);
}

TEST(SlamThreeSensors, TheSensorThatKnowsDistanceHasToInitialise) {
  const auto all = EightOfThreeSensors("together.yaml");
  const SweepSummary &fused = all.at("fused"), &pixels_first = all.at("pixels_first");
  EXPECT_NEAR(MeanOf(fused, "nees.mean:cam"), 1.0, 0.3);
  EXPECT_LE(MeanOf(fused, "rmse:cam.position"), MeanOf(all.at("depth"), "rmse:cam.position"));
  EXPECT_GE(MeanOf(pixels_first, "nees.mean:cam"), 3.0);
  EXPECT_GE(MeanOf(pixels_first, "rmse:cam.position"), 2.0 * MeanOf(fused, "rmse:cam.position"));
}

}  // namespace
}  // namespace alidade
