// SPDX-License-Identifier: Apache-2.0
//
// Tests a filter composed at compile time with a fixed number of landmarks, as in
// docs/static_filter.md. Compares it with the engine.
#include <gtest/gtest.h>

#include <array>
#include <string>
#include <utility>

#include "alidade/experiment/run.h"
#include "alidade/model/static_ekf.h"
#include "motion_models/constant.h"
#include "motion_models/quaternion_pose.h"
#include "sensors/inverse_depth_feature.h"

namespace alidade {
namespace {

// The state contains a camera and four points with uncertain positions.
using Point = Constant<3>;
using PointsFilter = StaticEkf<QuaternionPose, Point, Point, Point, Point>;
constexpr int kPosition = 0, kOrientation = 1, kFirstPoint = 4, kPoints = 4;

// Updates the block of landmark `point`. The landmark is known only at run time, but its block must
// be chosen at compile time.
template <class Filter, class Model, int... I>
StaticOutcome UpdateOf(int point, Filter& filter, const Model& sensor, const double* pixel,
                       std::integer_sequence<int, I...>) {
  StaticOutcome outcome = StaticOutcome::kInvalid;  // the outcome for an unknown landmark
  ((point == I ? void(outcome = filter.template Update<kPosition, kOrientation, kFirstPoint + I>(
                          sensor, pixel))
               : void()),
   ...);
  return outcome;
}

// The points are close to those of examples/10_slam_scene. The initial pose of the camera is known.
const std::string kFourPoints = R"(
alidade: 1
camera: {model: pinhole, width: 640, height: 480, fx: 525, fy: 525, cx: 320, cy: 240}
state:
  cam:
    model: quaternion_pose
    noise: {kind: discrete, linear_acceleration: 0.3, angular_acceleration: 0.05}
    initial:
      position: {mean: [0, 0, 0], sigma: 0}
      orientation: {mean: {w: 1, x: 0, y: 0, z: 0}, sigma: 0}
      velocity: {mean: [0.2, 0, 0], sigma: 0.1}
      angular_velocity: {mean: [0, 0, 0], sigma: 0.05}
sensors:
  pixels:
    model: inverse_depth_feature
    stream: tracks
    roles: {position: cam.position, orientation: cam.orientation, landmark: landmarks}
    sigma_px: 1.0
source:
  type: scene
  seed: 1
  max_frames: 100
  points: {list: [[-0.5, -0.3, 2], [0.6, -0.2, 2.5], [0.5, 0.4, 3], [-0.3, 0.4, 2.2]]}
  trajectory:
    random: {linear_acceleration: 0.3, angular_acceleration: 0.05, velocity: [0.2, 0, 0]}
estimators: {ekf: {type: ekf, fuse: per_measurement}}
)";

const Camera kLens(640, 480, 525.0, 525.0, 320.0, 240.0);

/// Sets the blocks of the camera to the initial values in kFourPoints.
template <class Filter>
void SetCamera(Filter& filter) {
  const double position[] = {0, 0, 0}, orientation[] = {1, 0, 0, 0};
  const double velocity[] = {0.2, 0, 0}, angular_velocity[] = {0, 0, 0};
  const Eigen::Matrix3d one = Eigen::Matrix3d::Identity();
  filter.template Set<0>(position, 0.0 * one);
  filter.template Set<1>(orientation, 0.0 * one);
  filter.template Set<2>(velocity, 0.1 * 0.1 * one);
  filter.template Set<3>(angular_velocity, 0.05 * 0.05 * one);
}

/// Runs the engine and the filter and compares their cameras at each frame. `first` processes the
/// measurements of the first frame for the filter.
template <class Filter, class Model, class First>
void ExpectTheEnginesCamera(const Config& config, Filter& filter, const Model& sensor,
                            const First& first) {
  const PluginHost host;
  Experiment experiment = BuildExperiment(config, host);
  Estimator& engine = *experiment.estimators.at(0).estimator;
  SetCamera(filter);
  Timestamp before{};
  int used = 0, frames = 0;
  for (SourceFrame frame; experiment.source->Next(frame); ++frames) {
    engine.Process(frame);
    if (frames > 0) {
      ASSERT_EQ(filter.Predict(Seconds(frame.timestamp) - Seconds(before)), Status::kOk);
    }
    before = frame.timestamp;
    for (const Measurement& m : frame.measurements) {
      if (frames == 0 && first(m)) continue;
      used += UpdateOf(static_cast<int>(m.landmark), filter, sensor, m.values.data(),
                       std::make_integer_sequence<int, kPoints>{}) == StaticOutcome::kAccepted;
    }
    const State& state = engine.state();
    const double tolerance = 1e-8;  // the summation order differs over 100 frames
    for (int i = 0; i < 3; ++i) {
      ASSERT_NEAR(filter.template value<0>()[i],
                  state.value(state.layout().Find("cam.position"))[i], tolerance)
          << "frame " << frames;
      ASSERT_NEAR(filter.covariance()(i, i), state.covariance().Variance(i), tolerance)
          << "frame " << frames;
    }
  }
  EXPECT_EQ(frames, 100);
  EXPECT_GT(used, 300);
}

TEST(StaticLandmarks, PointsThatAreKnownToSomeExtentAreBlocks) {
  const double places[kPoints][3] = {
      {-0.55, -0.3, 2.1}, {0.6, -0.25, 2.4}, {0.5, 0.4, 3}, {-0.3, 0.4, 2.2}};
  std::string known =
      "landmarks: {representation: xyz, prior: {inverse_distance: 0.4, sigma: 0.1}, known: [";
  for (int i = 0; i < kPoints; ++i) {
    known += "{id: " + std::to_string(i) + ", position: [";
    for (const double x : places[i]) known += std::to_string(x) + ", ";
    known += "], sigma: 0.1}, ";
  }
  const Config config = Config::FromText(kFourPoints + known + "]}\n", "four.yaml");

  const Point point(3);
  PointsFilter filter(QuaternionPose({0.3, 0.3, 0.3}, {0.05, 0.05, 0.05}), point, point, point,
                      point);
  const Eigen::Matrix3d p = 0.1 * 0.1 * Eigen::Matrix3d::Identity();
  filter.Set<kFirstPoint>(places[0], p);
  filter.Set<kFirstPoint + 1>(places[1], p);
  filter.Set<kFirstPoint + 2>(places[2], p);
  filter.Set<kFirstPoint + 3>(places[3], p);
  const InverseDepthFeature<Xyz> sensor(kLens, 1.0);
  ExpectTheEnginesCamera(config, filter, sensor, [](const Measurement&) { return false; });
}

/// Initialises a landmark from a pixel and a prior. The camera is at the origin, and the inverse
/// distance is 0.4 +- 0.1 1/m. P = J diag(1 px, 1 px, 0.1 1/m)^2 J'.
template <int... I, class Filter, class Model>
void SetFrom(const Measurement& seen, Filter& filter, const Model& sensor,
             std::integer_sequence<int, I...>) {
  using Jet = alidade::Jet<double, 3>;
  const Jet position[] = {Jet(0.0), Jet(0.0), Jet(0.0)};
  const Jet orientation[] = {Jet(1.0), Jet(0.0), Jet(0.0), Jet(0.0)};
  const Jet pixel[] = {Jet(seen.values[0], 0), Jet(seen.values[1], 1)}, prior[] = {Jet(0.4, 2)};
  Jet landmark[6];
  ASSERT_TRUE(sensor.Initialise(position, orientation, pixel, prior, landmark));
  double y[6];
  Eigen::Matrix<double, 6, 3> root;
  for (int k = 0; k < 6; ++k) {
    y[k] = landmark[k].a;
    root.row(k) << landmark[k].v[0], landmark[k].v[1], 0.1 * landmark[k].v[2];
  }
  const Eigen::Matrix<double, 6, 6> p = root * root.transpose();
  ((seen.landmark == I ? filter.template Set<kFirstPoint + I>(y, p) : void()), ...);
}

// The first pose is known, so the landmarks of the first frame are uncorrelated with each other.
TEST(StaticLandmarks, LandmarksOfTheFirstFrameMayBeOfInverseDepth) {
  const Config config = Config::FromText(kFourPoints +
                                             "landmarks: {representation: inverse_depth, prior: "
                                             "{inverse_distance: 0.4, sigma: 0.1}}\n",
                                         "four.yaml");
  const Constant<6> landmark(6);
  StaticEkf<QuaternionPose, Constant<6>, Constant<6>, Constant<6>, Constant<6>> filter(
      QuaternionPose({0.3, 0.3, 0.3}, {0.05, 0.05, 0.05}), landmark, landmark, landmark, landmark);
  const InverseDepthFeature<InverseDepth> sensor(kLens, 1.0);
  int set = 0;
  ExpectTheEnginesCamera(config, filter, sensor, [&](const Measurement& m) {
    SetFrom(m, filter, sensor, std::make_integer_sequence<int, kPoints>{});
    ++set;
    return true;
  });
  EXPECT_EQ(set, kPoints);
}

}  // namespace
}  // namespace alidade
