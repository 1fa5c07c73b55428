// SPDX-License-Identifier: Apache-2.0
//
// Tests the batch with sensors that have their own states, known numbers or several parts. On a
// nearly linear problem the batch equals the smoother.
#include <gtest/gtest.h>

#include <string>

#include "alidade/experiment/run.h"
#include "alidade/plugin/plugin_host.h"
#include "support/config_text.h"

namespace alidade {
namespace {

RunResult RunOf(const std::string& text) {
  const PluginHost host(std::vector<std::filesystem::path>{});
  Experiment experiment = BuildExperiment(testing::Read(text), host);
  const RunResult run = Run(experiment, {});
  EXPECT_EQ(run.status, RunStatus::kOk) << run.reason;
  return run;
}

void ExpectSmootherIsBatch(const RunResult& run, const std::string& block, double relative) {
  const std::string metric = "rmse:" + block;
  const double smoother = run.estimators.at(0).metrics.at(metric);
  EXPECT_NEAR(run.estimators.at(1).metrics.at(metric), smoother, relative * smoother) << block;
}

// The satellites are so far away that the ranges are linear to 1e-5 m.
TEST(BatchSensorStates, OfAClockAmongSatellitesIsTheSmoother) {
  const RunResult run = RunOf(
      "alidade: 1\n"
      "state:\n"
      "  receiver: {model: constant_velocity, dimensions: 3,\n"
      "    noise: {kind: continuous, acceleration: 0.3}, initial: {position: {mean: [0, 0, 0],\n"
      "    sigma: 20}, velocity: {mean: [1, 0, 0], sigma: 1}}}\n"
      "sensors:\n"
      "  gnss: {model: pseudorange, stream: ranges, sigma_m: 2, roles: {position: "
      "receiver.position},\n"
      "    initial: {clock_bias: {mean: 0, sigma: 100}}}\n"
      "source: {type: models, duration_s: 8, rate_hz: 2, sensors: {gnss: {known:\n"
      "  [[2e7, 0, 1e7], [-1e7, 2e7, 1e7], [0, -2e7, 1e7], [1e7, 1e7, 2e7], [0, 0, 2.2e7]]}}}\n"
      "estimators: {rts: {type: rts}, batch: {type: ceres_batch}}\n");
  ExpectSmootherIsBatch(run, "receiver.position", 1e-4);
  ExpectSmootherIsBatch(run, "gnss.clock_bias", 1e-4);
}

// The orientation has errors of about 0.006 rad, rotated by 0.3 rad. The smoother linearises at the
// estimates of the filter, so the smoother differs from the optimum by a few thousandths of the
// errors.
TEST(BatchSensorStates, OfPosesIsTheSmoother) {
  const RunResult run = RunOf(
      "alidade: 1\n"
      "state:\n"
      "  body:\n"
      "    model: quaternion_pose\n"
      "    noise: {kind: continuous, linear_acceleration: 0.3, angular_acceleration: 0.02}\n"
      "    initial:\n"
      "      position: {mean: [0, 0, 0], sigma: 0.5}\n"
      "      orientation: {mean: {w: 1, x: 0, y: 0, z: 0}, sigma: 0.02}\n"
      "      velocity: {mean: [0.5, 0, 0], sigma: 0.2}\n"
      "      angular_velocity: {mean: [0, 0, 0.1], sigma: 0.01}\n"
      "sensors:\n"
      "  mocap: {model: pose, stream: pose, sigma_position_m: 0.05, sigma_orientation_rad: 0.01,\n"
      "    roles: {position: body.position, orientation: body.orientation}}\n"
      "source: {type: models, duration_s: 3, rate_hz: 10}\n"
      "estimators: {rts: {type: rts}, batch: {type: ceres_batch}}\n");
  ExpectSmootherIsBatch(run, "body.position", 1e-6);
  ExpectSmootherIsBatch(run, "body.orientation", 2e-3);
}

}  // namespace
}  // namespace alidade
