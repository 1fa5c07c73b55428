// SPDX-License-Identifier: Apache-2.0
//
// Tests several runs and plugins in the same process.
#include <gtest/gtest.h>

#include <optional>

#include "alidade/experiment/run.h"
#include "support/program.h"

namespace alidade {
namespace {

using testing::kDepthConfig;

/// Last states of all estimators, and the metrics of the first one.
struct Result {
  std::vector<double> values, covariance;
  std::map<std::string, double> metrics;
  bool operator==(const Result&) const = default;
};

Result Finish(Experiment& experiment) {
  const RunResult run = Run(experiment, {});
  EXPECT_EQ(run.status, RunStatus::kOk) << run.reason;
  Result result;
  for (const EstimatorSpec& named : experiment.estimators) {
    const State& state = named.estimator->state();
    result.values.insert(result.values.end(), state.values().begin(), state.values().end());
    const Eigen::MatrixXd p = state.covariance().Dense();
    result.covariance.insert(result.covariance.end(), p.data(), p.data() + p.size());
  }
  result.metrics = run.estimators.at(0).metrics;
  return result;
}

Experiment Build(const PluginHost& host, const std::string& text = kDepthConfig) {
  return BuildExperiment(Config::FromText(text, "config.yaml"), host);
}

// Tests fault 72 of tests/faults/README.md.
TEST(OneProcess, TwoRunsAgreeWhateverRanBetween) {
  const PluginHost host(std::vector<std::filesystem::path>{});
  Experiment first = Build(host);
  Experiment waiting = Build(host);  // this experiment is created first and runs last
  const Result expected = Finish(first);
  EXPECT_FALSE(expected.metrics.empty());
  std::string other = kDepthConfig;
  other.replace(other.find("sigma_px: 1.0"), 13, "sigma_px: 7.0");
  Experiment between = Build(host, other);
  EXPECT_NE(Finish(between), expected);
  Experiment second = Build(host);
  EXPECT_EQ(Finish(second), expected);
  const PluginHost fresh(std::vector<std::filesystem::path>{});
  Experiment third = Build(fresh);
  EXPECT_EQ(Finish(third), expected);
  EXPECT_EQ(Finish(waiting), expected);
}

// Models, sources and estimators may be destroyed after the host that created them, in any order.
TEST(OneProcess, WhatAHostMadeOutlivesIt) {
  std::optional<PluginHost> host(std::in_place, std::vector<std::filesystem::path>{});
  Experiment kept = Build(*host);
  std::optional<Experiment> other(Build(*host));
  const Config entry = Config::FromText(
      "{model: stereo_disparity, focal_px: 400, baseline_m: 0.065, sigma_px: 1}", "entry.yaml");
  const SharedSensor sensor = host->CreateSensor("stereo_disparity", entry.root());
  host.reset();
  other.reset();
  const double depth = 0.5;
  const double* const role = &depth;
  double disparity = 0.0;
  EXPECT_EQ(sensor->Predict(&role, &disparity), Status::kOk);
  EXPECT_DOUBLE_EQ(disparity, 52.0);
  EXPECT_FALSE(Finish(kept).metrics.empty());
}

}  // namespace
}  // namespace alidade
