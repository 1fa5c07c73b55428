// SPDX-License-Identifier: Apache-2.0
//
// Landmarks of an estimator that uses what a filter before it accepted.
#include <gtest/gtest.h>

#include <map>
#include <string>

#include "alidade/host/plugin_host.h"
#include "alidade/run/run.h"

namespace alidade {
namespace {

// The ekf counts to `enter_after`; what it then passes on has waited.
TEST(AcceptedBy, LandmarksEnterAtTheSameObservation) {
  Config config = Config::FromFile(ALIDADE_SOURCE_DIR "/examples/10_slam_scene/config.yaml");
  for (const auto& [key, value] :
       std::map<std::string, std::string>{{"source.frames", "12"},
                                          {"landmarks.enter_after", "3"},
                                          {"estimators.follower.type", "ekf"},
                                          {"estimators.follower.use.accepted_by", "ekf"}}) {
    config.Set(key, value, "--set");
  }
  const PluginHost host;
  Experiment experiment = BuildExperiment(config, host);
  std::map<std::int64_t, Stamp> entered[2];
  RunOptions options;
  options.observe = [&](int index, const Frame& frame, const State&, const UpdateReport& report) {
    for (const MeasurementReport& entry : report.measurements()) {
      if (entry.outcome == Outcome::kInitialised)
        entered[index == 0 ? 0 : 1][entry.landmark] = frame.stamp;
    }
  };
  const RunResult run = alidade::Run(experiment, options);
  ASSERT_EQ(run.status, RunStatus::kOk) << run.reason;
  EXPECT_GT(entered[0].size(), 20u);
  EXPECT_EQ(entered[1], entered[0]);
}

}  // namespace
}  // namespace alidade
