// SPDX-License-Identifier: Apache-2.0
//
// Tests the landmarks of a batch and the motion of its camera.
#include <map>
#include <string>

#include "alidade/experiment/estimator_plugin.h"
#include "alidade/experiment/experiment.h"
#include "alidade/experiment/read_problem.h"
#include "batch_landmarks_fixture.h"
#include "plugins/scene/scene_fixture.h"

namespace alidade {
namespace {

using testing::Found;
using testing::MapProblem;
using testing::Solve;

TEST(CeresBatchLandmarks, WhatTheFilterForgetsAndMeetsAgainIsAnotherLandmark) {
  const MapProblem map(25, 12);
  std::vector<Frame> frames = map.frames;
  for (std::size_t k = 10; k < 14; ++k) {  // landmark 4 is out of view
    std::erase_if(frames[k].measurements, [](const Measurement& m) { return m.landmark == 4; });
  }
  Problem problem = map.Filter();
  problem.landmarks->max_missed_frames = 3;
  const Found found = Solve(problem, frames);
  ASSERT_FALSE(found.failed);
  EXPECT_EQ(found.Landmark(4).generation, 1);
  EXPECT_EQ(found.Landmark(3).generation, 0);
  // The result is the same if the landmark returns with a new id.
  for (std::size_t k = 14; k < frames.size(); ++k) {
    for (Measurement& m : frames[k].measurements) {
      if (m.landmark == 4) m.landmark = 104;
    }
  }
  const Found other = Solve(problem, frames);
  EXPECT_EQ(other.Cost(), found.Cost());
  EXPECT_LT((other.Landmark(104).position - found.Landmark(4).position).norm(), 1e-9);
}

// The batch does not delay landmarks a second time: the filter passes them on only after they have
// waited.
TEST(CeresBatchLandmarks, WhatAFilterAcceptedEntersAtOnce) {
  Config config = Config::FromFile(ALIDADE_SOURCE_DIR "/examples/10_slam_scene/config.yaml");
  for (const auto& [key, value] :
       std::map<std::string, std::string>{{"landmarks.min_observations", "3"},
                                          {"estimators.batch", "{type: ceres_batch}"},
                                          {"estimators.batch.use.accepted_by", "ekf"}}) {
    config.Set(key, value, "--set");
  }
  const Experiment experiment = BuildExperiment(config, testing::Shipped());
  ASSERT_EQ(experiment.estimators.size(), 2u);
  EXPECT_EQ(experiment.estimators[0].problem.landmarks->min_observations, 3);
  EXPECT_EQ(experiment.estimators[1].problem.landmarks->min_observations, 1);
}

TEST(CeresBatchLandmarks, GivesTheSameBytesTwice) {
  const MapProblem map(15, 8);
  const Found one = Solve(map.Filter(), map.frames);
  const Found two = Solve(map.Filter(), map.frames);
  EXPECT_EQ(map.Solution(one), map.Solution(two));
  EXPECT_EQ(one.events.back().text, two.events.back().text);
}

// ---- a rotating camera --------------------------------------------------------------------------

const std::string kMotion =
    "state: {cam: {model: quaternion_pose, noise: {kind: discrete, linear_acceleration: 0.3, "
    "angular_acceleration: 0.05}, initial: {position: {mean: [0, 0, 0], sigma: 0}, orientation: "
    "{mean: {w: 1, x: 0, y: 0, z: 0}, sigma: 0}, velocity: {mean: [0.2, 0, 0], sigma: 0.1}, "
    "angular_velocity: {mean: [0, 0, 0], sigma: 0.05}}}}\n";
const std::string kSensors =
    "landmarks: {representation: inverse_depth, prior: {inverse_distance: 0.39, sigma: 0.09}}\n"
    "sensors:\n"
    "  pixels: {model: inverse_depth_feature, stream: tracks, sigma_px: 1, roles: {position: "
    "cam.position, orientation: cam.orientation, landmark: landmarks}}\n"
    "  known: {model: depth_feature, stream: known, sigma_px: 1, sigma_depth_m: 0.02, roles: "
    "{position: cam.position, orientation: cam.orientation, landmark: landmarks}}\n";
const std::string kDrawn =
    "max_frames: 40, rate_hz: 30, sigma_px: 1, known_points: {count: 4, sigma_depth_relative: "
    "0.005}, "
    "points: {box: {min: [-0.8, -0.7, 1.6], max: [1.2, 0.7, 3.6]}, count: 40}, trajectory: "
    "{random: {linear_acceleration: 0.3, angular_acceleration: 0.05, velocity: [0.2, 0, 0]}}";

// The noise has rank 6 of 12. v' and omega' therefore determine the changes of r and q.
TEST(CeresBatchLandmarks, NoiseOfLowRankMovesTheCameraExactlyAsItsModelSays) {
  const testing::MadeScene made = testing::MakeScene(kDrawn);
  const Config config = Config::FromText(testing::kCamera + kMotion + kSensors, "system.yaml");
  const Problem problem = ReadProblem(config.root(), testing::Shipped(), {});
  const Config entry = Config::FromText("type: ceres_batch", "batch.yaml");
  const auto batch = CreateEstimator(testing::Shipped(), "ceres_batch", entry.root())(
      problem, made.scene->streams());
  std::vector<Frame> frames;
  for (SourceFrame frame; made.scene->Next(frame);) frames.push_back(frame);
  const Found found = Solve(*batch, frames);
  ASSERT_FALSE(found.failed) << found.events.back().text;
  ASSERT_EQ(found.states.size(), 40u);
  const StateLayout& layout = problem.layout;
  const auto value = [&](std::size_t k, const char* block) {
    return found.states[k].value(layout.Find(block));
  };
  double moved = 0.0;
  for (std::size_t k = 1; k < found.states.size(); ++k) {
    const double dt_s = Seconds(frames[k].timestamp - frames[k - 1].timestamp);
    double turn[3], expected[4], defect[3];
    for (int i = 0; i < 3; ++i) {
      EXPECT_NEAR(value(k, "cam.position")[i],
                  value(k - 1, "cam.position")[i] + dt_s * value(k, "cam.velocity")[i], 1e-12);
      turn[i] = dt_s * value(k, "cam.angular_velocity")[i];
      moved =
          std::max(moved, std::abs(value(k, "cam.velocity")[i] - value(k - 1, "cam.velocity")[i]));
    }
    UnitQuaternion::Plus(value(k - 1, "cam.orientation"), turn, expected);
    UnitQuaternion::Minus(value(k, "cam.orientation"), expected, defect);
    for (const double d : defect) EXPECT_NEAR(d, 0.0, 1e-12);
  }
  EXPECT_GT(moved, 1e-3);  // the constraint is not trivial
  EXPECT_EQ(found.map.size(), 40u);
}

}  // namespace
}  // namespace alidade
