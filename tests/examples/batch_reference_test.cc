// SPDX-License-Identifier: Apache-2.0
//
// Checks the claims of docs/is_batch_the_truth.md about the batch as a reference. Uses
// examples/10_slam_scene.
#include <gtest/gtest.h>

#include <filesystem>

#include "alidade/sweep/sweep.h"

namespace alidade {
namespace {

using Settings = std::vector<std::pair<std::string, std::string>>;

const std::pair<std::string, std::string> kWrongPrior = {"landmarks.prior",
                                                         "{inverse_distance: 0.49, sigma: 0.11}"};
const Settings kNoKnownDepth = {{"estimators.ekf.sensors", "[pixels]"},
                                {"estimators.batch.sensors", "[pixels]"}};

/// Summaries of the filter and of the batch over the seeds 1001 and 1002.
struct EkfAndBatch {
  SweepSummary ekf, batch;

  EkfAndBatch(const char* name, const Settings& settings) {
    Config config = Config::FromFile(std::filesystem::path(ALIDADE_SOURCE_DIR) /
                                     "examples/10_slam_scene" / name);
    for (const auto& [key, value] : settings) config.Set(key, value, "--set");
    const PluginHost host(PluginPaths(config));
    SweepOptions options;
    options.runs = 2;
    options.first_seed = 1001;
    for (SweepSummary& summary : Summarise(Sweep(config, host, options))) {
      (summary.name == "batch" ? batch : ekf) = std::move(summary);
    }
    EXPECT_EQ(batch.used, 2);
  }
};

double Of(const SweepSummary& one, const char* metric) { return one.metrics.at(metric).mean; }

bool HasCeres() {
#ifdef ALIDADE_WITHOUT_CERES
  return false;
#else
  return true;
#endif
}

// With known depth the batch is correct: its scale is 1, and its covariance agrees with its errors.
// The batch smooths the whole trajectory, so only its last frame can be compared with the filter.
TEST(BatchReference, IsRightWhereScaleIsAnchored) {
  if (!HasCeres()) GTEST_SKIP() << "this build does not contain the Ceres solver";
  const EkfAndBatch means("batch.yaml", {});
  EXPECT_NEAR(Of(means.batch, "map.sim3.scale"), 1.0, 0.005);
  EXPECT_NEAR(Of(means.batch, "nees.mean:cam"), 1.0, 0.5);
  EXPECT_NEAR(Of(means.ekf, "map.sim3.rmse") / Of(means.batch, "map.sim3.rmse"), 1.0, 0.1);
  const double path = Of(means.ekf, "rmse:cam.position") / Of(means.batch, "rmse:cam.position");
  const double last =
      Of(means.ekf, "final_error:cam.position") / Of(means.batch, "final_error:cam.position");
  EXPECT_GE(path, 1.3);
  EXPECT_LE(last, 1.25);
}

// The only information on scale comes from 40 priors, whose mean inverse distance is 1 / 0.8 times
// the truth. The error of the batch is larger than that of the filter, and only NEES reveals the
// error.
TEST(BatchReference, IsWrongWhereScaleIsVotedByPriors) {
  if (!HasCeres()) GTEST_SKIP() << "this build does not contain the Ceres solver";
  Settings settings = kNoKnownDepth;
  settings.push_back(kWrongPrior);
  const EkfAndBatch means("batch.yaml", settings);
  EXPECT_NEAR(Of(means.batch, "map.sim3.scale"), 1.0 / 0.8, 0.08);
  EXPECT_GE(Of(means.batch, "nees.mean:cam"), 4.0);
  EXPECT_GE(Of(means.ekf, "nees.mean:cam"), 3.0);
  EXPECT_NEAR(Of(means.ekf, "nis.mean:pixels"), 1.0, 0.05);
  EXPECT_LE(Of(means.batch, "map.sim3.rmse"), 0.0075);
  EXPECT_GE(Of(means.batch, "map.rmse"), 0.2);
}

}  // namespace
}  // namespace alidade
