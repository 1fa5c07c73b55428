// SPDX-License-Identifier: Apache-2.0
//
// Tests the landmarks of an estimator that uses the measurements accepted by an earlier filter.
#include <gtest/gtest.h>

#include <map>
#include <string>

#include "alidade/experiment/run.h"
#include "alidade/plugin/plugin_host.h"

namespace alidade {
namespace {

/// Observer that records the time at which each estimator initialised each landmark.
class Entries : public RunObserver {
 public:
  void OnEstimate(int estimator, const SourceFrame& frame, const State&,
                  const UpdateReport& report) override {
    for (const MeasurementReport& entry : report.measurements()) {
      if (entry.outcome == Outcome::kInitialised)
        entered[estimator][entry.landmark] = frame.timestamp;
    }
  }
  std::map<int, std::map<std::int64_t, Timestamp>> entered;
};

// The ekf counts observations up to `min_observations`, so the landmarks that it passes on have
// already waited.
TEST(AcceptedBy, LandmarksEnterAtTheSameObservation) {
  Config config = Config::FromFile(ALIDADE_SOURCE_DIR "/examples/10_slam_scene/config.yaml");
  for (const auto& [key, value] :
       std::map<std::string, std::string>{{"source.max_frames", "12"},
                                          {"landmarks.min_observations", "3"},
                                          {"estimators.follower", "{type: ekf}"},
                                          {"estimators.follower.use.accepted_by", "ekf"}}) {
    config.Set(key, value, "--set");
  }
  const PluginHost host;
  Experiment experiment = BuildExperiment(config, host);
  Entries entries;
  RunOptions options;
  options.observers = {&entries};
  const RunResult run = alidade::Run(experiment, options);
  ASSERT_EQ(run.status, RunStatus::kOk) << run.reason;
  EXPECT_GT(entries.entered[0].size(), 20u);
  EXPECT_EQ(entries.entered[1], entries.entered[0]);
}

}  // namespace
}  // namespace alidade
