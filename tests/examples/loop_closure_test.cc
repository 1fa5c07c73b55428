// SPDX-License-Identifier: Apache-2.0
//
// Tests examples/30_loop_closure: the odometry drifts, and loop closures remove the drift.
#include <gtest/gtest.h>

#include <filesystem>

#include "alidade/sweep/sweep.h"

namespace alidade {
namespace {

/// Returns the summaries of the estimators `ekf` and `batch` over 10 seeds.
auto SweepLoops(const std::string& radius_m) {
  Config config = Config::FromFile(std::filesystem::path(ALIDADE_SOURCE_DIR) /
                                   "examples/30_loop_closure/config.yaml");
  config.Set("source.keyframes.closure_radius_m", radius_m, "test");
  const PluginHost host(PluginPaths(config));
  SweepOptions options;
  options.runs = 10;
  options.first_seed = 1001;
  auto summaries = Summarise(Sweep(config, host, options));
  EXPECT_EQ(summaries.size(), 2u);
  for (const auto& one : summaries) EXPECT_EQ(one.diverged + one.CountOf(VerdictState::kLost), 0);
  return summaries;
}

TEST(LoopClosure, TakesTheDriftOutOfFilterAndBatch) {
#ifdef ALIDADE_WITHOUT_CERES
  GTEST_SKIP() << "this build does not contain the Ceres solver";
#endif
  const auto open = SweepLoops("none"), closed = SweepLoops("1");
  const auto mean = [](const auto& of, const char* metric) { return of.metrics.at(metric).mean; };
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_LT(mean(closed[i], "map.sim3.rmse"), 0.2 * mean(open[i], "map.sim3.rmse"));
    EXPECT_NEAR(mean(closed[i], "nees.mean:cam"), 1.0, 0.3);
  }
  EXPECT_NEAR(mean(closed[0], "nis.mean:loops"), 1.0, 0.15);
  // The batch also corrects the path before the first loop closure. At the end, the filter and the
  // batch have used the same data on the keyframes.
  EXPECT_LT(mean(closed[1], "rmse:cam.position"), 0.6 * mean(closed[0], "rmse:cam.position"));
  EXPECT_LT(mean(closed[0], "map.rmse"), 1.15 * mean(closed[1], "map.rmse"));
}

}  // namespace
}  // namespace alidade
