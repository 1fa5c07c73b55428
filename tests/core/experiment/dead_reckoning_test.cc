// SPDX-License-Identifier: Apache-2.0
//
// Tests estimators without sensors, which only predict.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <utility>

#include "alidade/experiment/run.h"

namespace alidade {
namespace {

/// Config of a target that moves with its initial velocity.
std::string WithoutNoise(const std::string& sensors, const std::string& estimators) {
  return R"(alidade: 1
state:
  target: {model: constant_velocity, noise: {acceleration: 0},
           initial: {position: {mean: 3, sigma: 1}, velocity: {mean: 2, sigma: 0.5}}}
sensors: )" +
         sensors + R"(
source: {type: models, duration_s: 4, rate_hz: 10, start: mean}
estimators: )" +
         estimators + '\n';
}
constexpr const char* kSensor =
    "{fix: {model: direct, stream: fix, sigma: 1, roles: {value: target.position}}}";

/// Keeps the last estimate of each estimator.
class LastEstimates : public RunObserver {
 public:
  void OnEstimate(int estimator, const SourceFrame& frame, const State& state,
                  const UpdateReport& /*report*/) override {
    if (estimator != 0 || Seconds(frame.timestamp) < t_s) return;
    t_s = Seconds(frame.timestamp);
    position = state.Estimate(0).value[0];
    sigma = state.Estimate(0).sigma[0];
  }
  double t_s = 0.0, position = 0.0, sigma = 0.0;
};

// x = 3 + 2 t, and Var(x) = 1 + (0.5 t)^2. At 4 s: x = 11, sigma = sqrt(5).
TEST(DeadReckoning, PredictsTheState) {
  const PluginHost host;
  const std::pair<const char*, const char*> cases[] = {{"{}", "[ekf]"},
                                                       {kSensor, "{ekf: {sensors: []}}"},
                                                       {kSensor, "{ukf: {sensors: []}}"},
                                                       {kSensor, "{rts: {sensors: []}}"}};
  for (const auto& [sensors, estimators] : cases) {
    Experiment experiment =
        BuildExperiment(Config::FromText(WithoutNoise(sensors, estimators), "f.yaml"), host);
    LastEstimates last;
    RunOptions options;
    options.observers = {&last};
    const RunResult result = alidade::Run(experiment, options);
    ASSERT_EQ(result.status, RunStatus::kOk) << result.reason;
    EXPECT_NEAR(last.t_s, 4.0, 1e-9) << estimators;
    EXPECT_NEAR(last.position, 11.0, 1e-9) << estimators;
    EXPECT_NEAR(last.sigma, std::sqrt(5.0), 1e-9) << estimators;
    EXPECT_NEAR(result.estimators[0].metrics.at("rmse:target.position"), 0.0, 1e-9) << estimators;
  }
}

}  // namespace
}  // namespace alidade
