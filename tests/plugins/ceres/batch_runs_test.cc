// SPDX-License-Identifier: Apache-2.0
#include "alidade/check/plugin_listing.h"
#include "alidade/experiment/run.h"
#include "batch_fixture.h"

namespace alidade {
namespace {

using testing::Shipped;

RunResult RunDepth(int seed, const std::vector<std::pair<std::string, std::string>>& settings) {
  const std::string file = ALIDADE_SOURCE_DIR "/examples/05_depth_principled/config.yaml";
  Config config = Config::FromFile(file);
  config.Set("source.seed", std::to_string(seed), "--set");
  for (const auto& [key, value] : settings) config.Set(key, value, "--set");
  Experiment experiment = BuildExperiment(config, Shipped());
  return Run(experiment, {});
}

// In a prototype, the RTS smoother and the batch had an RMSE of 1.03 mm and a coverage of 99 % over
// 1000 seeds.
TEST(CeresBatch, SmoothsDepthToAMillimetre) {
  double rmse = 0.0, coverage = 0.0;
  for (int seed = 1001; seed <= 1020; ++seed) {
    const RunResult run = RunDepth(seed, {{"estimators.batch", "{type: ceres_batch}"}});
    ASSERT_EQ(run.status, RunStatus::kOk) << run.reason;
    const EstimatorResult& batch = run.estimators[1];
    EXPECT_FALSE(batch.diverged);
    rmse += batch.metrics.at("rmse:target.depth") / 20.0;
    coverage += batch.metrics.at("nees.within95:target") / 20.0;
  }
  RecordProperty("rmse_mm", std::to_string(1e3 * rmse));
  RecordProperty("coverage", std::to_string(coverage));
  EXPECT_LE(rmse, 1.2e-3);
  EXPECT_GE(coverage, 0.95);
}

TEST(CeresBatch, TheFilterIsNearlyAsGoodAsFullInformation) {
  double filter = 0.0, full = 0.0;
  for (int seed = 1001; seed <= 1005; ++seed) {
    const RunResult run = RunDepth(
        seed, {{"estimators.full", "{type: ceres_batch}"}, {"estimators.full.mode", "filtering"}});
    ASSERT_EQ(run.status, RunStatus::kOk) << run.reason;
    filter += run.estimators[0].metrics.at("rmse:target.depth");
    full += run.estimators[1].metrics.at("rmse:target.depth");
  }
  RecordProperty("ratio", std::to_string(filter / full));
  EXPECT_LE(filter / full, 1.02);
  EXPECT_GE(filter / full, 0.95);
}

bool HasEvent(const EstimatorResult& result, EventKind kind, const std::string& words) {
  return std::ranges::any_of(result.events, [&](const Event& event) {
    return event.kind == kind && event.text.find(words) != std::string::npos;
  });
}

TEST(CeresBatch, ASolveThatDoesNotConvergeIsAFailureAndAnEvent) {
  const RunResult run = RunDepth(
      1, {{"estimators.batch", "{type: ceres_batch}"}, {"estimators.batch.max_iterations", "1"}});
  EXPECT_EQ(run.status, RunStatus::kFailed);
  EXPECT_EQ(run.code, ExitCode::kDiverged);
  EXPECT_NE(run.reason.find("estimator 'batch': cost"), std::string::npos) << run.reason;
  EXPECT_TRUE(HasEvent(run.estimators[1], EventKind::kSolution, "not converged"));
  EXPECT_EQ(run.estimators[0].counts.at("accepted:scale"), 152);
}

TEST(CeresBatch, WhereNothingIsDefinedItSaysSoAndTheOthersGoOn) {
  const RunResult run =
      RunDepth(1, {{"estimators.batch", "{type: ceres_batch}"},
                   {"estimators.batch.overrides.state.target.initial.depth.mean", "-1"},
                   {"estimators.batch.overrides.state.target.initial.depth.sigma", "0"},
                   {"estimators.batch.overrides.state.target.noise.acceleration", "0"}});
  EXPECT_EQ(run.code, ExitCode::kDiverged);
  EXPECT_TRUE(HasEvent(run.estimators[1], EventKind::kFailed,
                       "sensor 'scale' at 0.000000 s: out of its domain"));
  EXPECT_EQ(run.estimators[1].metrics.count("rmse:target.depth"), 0u);
  EXPECT_FALSE(run.estimators[0].diverged);
}

// ---- configs ------------------------------------------------------------------------------------

using CeresBatchConfig = HostTest;

TEST_F(CeresBatchConfig, WhatItCannotDoIsRefusedByName) {
  const auto expect = [&](const std::string& key, const std::string& value,
                          const std::string& place, const std::string& what) {
    ExpectError(ExitCode::kBadConfig,
                {place + ": estimator type 'ceres_batch' does not support " + what + ';'}, [&] {
                  RunDepth(1, {{"estimators.batch", "{type: ceres_batch}"}, {key, value}});
                });
  };
  expect("sensors.scale.roles",
         "{depth: target.depth, inverse_distance: {block: template.inverse_distance, mode: known}}",
         "sensors.scale.roles.inverse_distance.mode", "known roles");
  expect("sensors.stereo.roles", "{depth: {block: target.depth, jacobian_at: measurement}}",
         "sensors.stereo.roles.depth.jacobian_at", "jacobian_at: measurement");
  expect("state.template.consider", "[inverse_distance]", "state.template.consider[0]",
         "consider blocks");
}

TEST_F(CeresBatchConfig, KeysOfTheFiltersAreRefusedByName) {
  const auto expect = [&](const std::string& key, const std::string& value,
                          const std::string& words) {
    ExpectError(ExitCode::kBadConfig, {"estimators.batch." + key + ": estimator type", words}, [&] {
      RunDepth(1,
               {{"estimators.batch", "{type: ceres_batch}"}, {"estimators.batch." + key, value}});
    });
  };
  expect("gate", "0.99", "'ceres_batch' has no gate; remove this key, or use type: ekf");
  expect("fuse", "joint", "'ceres_batch' has no option for the grouping of updates");
  expect("jacobian", "latest", "'ceres_batch' has no option for the Jacobian");
  expect("rejection_recovery", "{after: 3}", "'ceres_batch' has no rejection recovery");
}

TEST_F(CeresBatchConfig, IsListedWithItsKeysAndThoseOfEveryEstimator) {
  const std::string info = PluginInfo(Shipped(), "ceres_batch");
  for (const char* words : {"ceres_batch: estimator", "[Bell1994]", "smoothing | filtering",
                            "max_outer_iterations", "on_divergence", "overrides"}) {
    EXPECT_NE(info.find(words), std::string::npos) << words << " is not in\n" << info;
  }
}

TEST_F(CeresBatchConfig, BadOptionsAndTypesAreErrorsWithAPlace) {
  const auto run = [](const std::string& key, const std::string& value) {
    RunDepth(1, {{"estimators.batch", "{type: ceres_batch}"}, {key, value}});
  };
  ExpectError(ExitCode::kBadConfig, {"estimators.batch.mode", "some", "smoothing, filtering"},
              [&] { run("estimators.batch.mode", "some"); });
  ExpectError(ExitCode::kBadConfig, {"estimators.batch.max_iterations", "[1, 1000000]"},
              [&] { run("estimators.batch.max_iterations", "0"); });
  ExpectError(ExitCode::kBadConfig, {"max_iteration", "did you mean 'max_iterations'?"},
              [&] { run("estimators.batch.max_iteration", "3"); });
  const auto incremental = [](const std::string& key, const std::string& value) {
    RunDepth(1, {{"estimators.batch", "{type: ceres_batch}"},
                 {"estimators.batch.mode", "incremental"},
                 {"estimators.batch." + key, value}});
  };
  ExpectError(ExitCode::kBadConfig, {"estimators.batch.solver", "unknown key"},
              [&] { incremental("solver", "dense"); });
  ExpectError(ExitCode::kBadConfig, {"estimators.batch.relinearise_above", "a number > 0"},
              [&] { incremental("relinearise_above", "0"); });
  ExpectError(
      ExitCode::kPlugin,
      {"estimators.batch.type", "estimator type 'ceres_bach' is neither built in nor in a plugin",
       "ekf", "ceres_batch"},
      [&] { run("estimators.batch.type", "ceres_bach"); });
}

}  // namespace
}  // namespace alidade
