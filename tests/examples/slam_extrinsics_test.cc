// SPDX-License-Identifier: Apache-2.0
//
// Tests a state that contains the extrinsics of a camera on a vehicle with odometry. The state also
// contains the speed scale of the odometry.
#include <gtest/gtest.h>

#include "alidade/sweep/sweep.h"

namespace alidade {
namespace {

// The odometry is measured in the frame of the camera, so the true vehicle_from_cam is the
// identity. The vehicle_from_cam of the config is rotated by 0.03 rad about x (pitch) and by 0.02
// rad about y.
constexpr const char* kConfig = R"(
alidade: 1
camera: {width: 640, height: 480, fx: 525, fy: 525, cx: 320, cy: 240}
state:
  cam:
    model: odometry_pose
    input: {stream: odometry}
    vehicle_from_cam: {orientation: {w: 0.99983751, x: 0.01499919, y: 0.00999946, z: 0.0}}
    noise: {kind: discrete, linear_velocity: 0.004, angular_velocity: 0.002}
    initial:
      position: {mean: [-0.6, 0, 0], sigma: 0}
      orientation: {mean: {w: 0.997230252466, x: 0, y: 0.074376229844, z: 0}, sigma: 0}
landmarks: {representation: anchored, prior: {inverse_distance: 0.27, sigma: 0.07}}
sensors:
  pixels:
    model: inverse_depth_feature
    stream: tracks
    roles: {position: cam.position, orientation: cam.orientation, landmark: landmarks}
    sigma_px: 1.0
source:
  type: scene
  max_frames: 100
  rate_hz: 10
  sigma_px: 1.0
  simulate_odometry: true
  odometry_noise: {linear_velocity: 0.004, angular_velocity: 0.002}
  points: {box: {min: [-1.2, -0.9, 2.2], max: [1.2, 0.9, 5.5]}, count: 40}
  trajectory:
    look_at:
      - {position: [-0.6, 0, 0], target: [0, 0, 4]}
      - {position: [0, 0.1, 0.2], target: [0, 0, 4]}
      - {position: [0.6, 0, 0], target: [0, 0, 4]}
      - {position: [0.1, -0.3, 0.8], target: [0, 0, 4]}
      - {position: [-0.6, 0, 0], target: [0, 0, 4]}
estimators:
  ekf: {type: ekf, gate: 0.9999}
  estimated:
    type: ekf
    gate: 0.9999
    overrides:
      state:
        cam:
          initial: {extrinsics_orientation: {mean: {w: 1, x: 0, y: 0, z: 0}, sigma: 0.03}}
  considered:
    type: ekf
    gate: 0.9999
    overrides:
      state:
        cam:
          consider: [extrinsics_orientation]
          initial: {extrinsics_orientation: {mean: {w: 1, x: 0, y: 0, z: 0}, sigma: 0.03}}
)";

std::vector<SweepSummary> Ten() {
  const Config config = Config::FromText(kConfig, "extrinsics.yaml");
  const PluginHost host(PluginPaths(config));
  SweepOptions options;
  options.runs = 10;
  options.first_seed = 1;
  return Summarise(Sweep(config, host, options));
}

// The extrinsics in the config are wrong. If they are estimated or considered, the path stays
// accurate and the filter stays consistent.
TEST(SlamExtrinsics, MayBeWrongWhereItIsInTheState) {
  const auto summaries = Ten();
  const auto& without = summaries.at(0).metrics;
  EXPECT_GE(without.at("nees.mean:cam").mean, 4.0);
  for (const std::size_t in_state : {1, 2}) {
    SCOPED_TRACE(summaries.at(in_state).name);
    const auto& with = summaries.at(in_state).metrics;
    EXPECT_EQ(summaries.at(in_state).diverged + summaries.at(in_state).CountOf(VerdictState::kLost),
              0);
    EXPECT_LE(with.at("rmse:cam.position").mean, 0.6 * without.at("rmse:cam.position").mean);
    EXPECT_GE(with.at("nees.mean:cam").mean, 0.7);
    EXPECT_LE(with.at("nees.mean:cam").mean, 1.6);
  }
  EXPECT_LE(summaries.at(1).metrics.at("rmse:cam.position").mean,
            summaries.at(2).metrics.at("rmse:cam.position").mean);
}

}  // namespace
}  // namespace alidade
