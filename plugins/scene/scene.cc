// SPDX-License-Identifier: Apache-2.0
#include "scene.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "alidade/base/random.h"
#include "alidade/model/camera.h"
#include "alidade/model/geometry.h"
#include "keyframes.h"
#include "points.h"
#include "surfaces.h"
#include "trajectory.h"

namespace alidade {
namespace {

class Scene : public Source {
 public:
  explicit Scene(const SourceArguments& arguments)
      : camera_(arguments.params),
        pixel_noise_(arguments.seed, 2),
        odometry_noise_(arguments.seed, 3),
        image_noise_(arguments.seed, 4),
        keyframes_(arguments.params, arguments.seed) {
    const Node& entry = arguments.entry;
    ReadNumbers(arguments.params);
    for (const char* key : {"points", "trajectory", "surfaces", "state_entry"}) entry.Declare(key);
    Random point_random(arguments.seed, 0), trajectory_random(arguments.seed, 1);
    points_ = scene::ReadPoints(entry.At("points", "scene"), point_random);
    trajectory_ =
        scene::ReadTrajectory(entry.At("trajectory", "scene"), count_, dt_s_, trajectory_random);
    if (const auto surfaces = entry.Find("surfaces")) surfaces_ = scene::ReadSurfaces(*surfaces);
    was_in_previous_frame_.assign(points_.size(), false);
    was_seen_.assign(points_.size(), false);
    const auto state = entry.Find("state_entry");
    DefineStreams(state ? state->Text() : "cam");
  }

  const std::vector<StreamInfo>& streams() const override { return streams_; }
  const std::vector<StreamInfo>& truths() const override { return truths_; }
  std::int64_t size() const override { return static_cast<std::int64_t>(count_); }

  std::optional<std::array<double, 3>> TrueLandmark(std::int64_t id) const override {
    const auto index = static_cast<std::size_t>(id);
    if (id < 0 || index >= points_.size() + keyframes_.size()) return std::nullopt;
    if (index >= points_.size()) return keyframes_.position(index - points_.size());
    return scene::ToArray(points_[index]);
  }

  int views() const override { return surfaces_.empty() ? 0 : measures_ == kStereo ? 2 : 1; }
  GreyImage Draw(int view) override {
    const scene::CameraState& state = trajectory_[index_ - 1];
    const double from_left[3] = {view * baseline_m_, 0.0, 0.0};
    Eigen::Vector3d eye;
    UnitQuaternion::Rotate(state.orientation.data(), from_left, eye.data());
    for (std::size_t i = 0; i < 3; ++i) eye[static_cast<int>(i)] += state.position[i];
    return Render(surfaces_, camera_, eye.data(), state.orientation.data(), image_noise_grey_,
                  image_noise_);
  }

  bool Next(SourceFrame& frame) override {
    if (index_ == count_) return false;
    const scene::CameraState& state = trajectory_[index_];
    frame.timestamp = TimestampFromSeconds(static_cast<double>(index_) * dt_s_);
    frame.measurements.clear();
    const auto list = [](const auto& values) {
      return std::vector<double>(values.begin(), values.end());
    };
    frame.truth = {list(state.position), list(state.orientation), list(state.velocity),
                   list(state.angular_velocity)};
    for (const Observation& observation : Observe(state)) EmitObservation(observation, frame);
    if (odometry_stream_ >= 0 && index_ + 1 < count_) EmitOdometry(frame);
    if (keyframes_.is_enabled())
      keyframes_.Emit(index_, state, keyframe_stream_, points_.size(), frame);
    ++index_;
    return true;
  }

 private:
  enum Measures { kPixel, kStereo, kDepth };
  /// Observation of a visible point.
  struct Observation {
    std::size_t point;
    double pixel[2];              ///< exact pixel
    double depth;                 ///< exact depth hz, m
    std::array<double, 4> noise;  ///< noise of unit variance
  };

  void ReadNumbers(Params& p) {
    count_ =
        static_cast<std::size_t>(p.Integer("max_frames", "number of frames", 1, 1'000'000, 150));
    dt_s_ = 1.0 / p.Number("rate_hz", "Hz", "frames per second", {1e-3, 1e6}, 30.0);
    sigma_px_ = p.NonNegative("sigma_px", "px", "noise of a pixel coordinate, 1 sigma", 1.0);
    max_features_ = static_cast<std::size_t>(p.Integer(
        "max_features_per_frame", "maximum number of points in a frame", 1, 1 << 30, 1 << 30));
    image_noise_grey_ =
        p.NonNegative("image_noise_grey", "1",
                      "noise of a pixel in images of surfaces, in grey levels (0 to 255)", 2.0);
    measures_ = static_cast<Measures>(p.Choice("measures", {"pixel", "stereo", "depth"},
                                               "values of a point in stream tracks", kPixel));
    if (measures_ == kStereo) {
      baseline_m_ = p.Positive("camera.baseline_m", "m", "stereo baseline");
      if (camera_.model != CameraModel::kPinhole) {
        p.Fail("camera.model", "must be 'pinhole', because a rectified pair has no distortion");
      }
    }
    if (measures_ == kDepth) {
      sigma_depth_m_ = p.NonNegative("sigma_depth_m", "m", "noise of the depth, 1 sigma");
    }
    if (measures_ == kPixel) {
      remaining_known_ = p.Integer(
          "known_points.count", "number of points with a measured depth at their first observation",
          0, 1 << 20, 0);
      known_sigma_ = p.Number("known_points.sigma_depth_relative", "",
                              "noise of this depth, relative to the depth, 1 sigma",
                              {0.0, 1.0, true, false}, 0.005);
    }
    if (p.Flag("simulate_odometry", "whether the source has the stream odometry", false)) {
      odometry_stream_ = 0;  // DefineStreams() sets the index
      linear_sigma_ = p.NonNegative("odometry_noise.linear_velocity", "m/s",
                                    "noise of each axis, 1 sigma", 0.0);
      angular_sigma_ = p.NonNegative("odometry_noise.angular_velocity", "rad/s",
                                     "noise of each axis, 1 sigma", 0.0);
    }
  }

  void DefineStreams(const std::string& state) {
    constexpr int kSizes[] = {2, 4, 3};
    streams_ = {{"tracks", kSizes[measures_]}};
    if (remaining_known_ > 0) streams_.push_back({.name = "known", .size = 3, .covariance = 3});
    if (odometry_stream_ >= 0) {
      odometry_stream_ = static_cast<int>(streams_.size());
      streams_.push_back({"odometry", 6});
    }
    if (keyframes_.is_enabled()) {
      keyframe_stream_ = static_cast<int>(streams_.size());
      streams_.push_back({"relative_poses", 7});
    }
    truths_ = {{state + ".position", 3},
               {state + ".orientation", 4},
               {state + ".velocity", 3},
               {state + ".angular_velocity", 3}};
  }

  /// Returns the observations of the points visible from `state`, in the order of the ids.
  std::vector<Observation> Observe(const scene::CameraState& state) {
    std::vector<Observation> observations;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      Observation observation{i, {}, 0.0, {}};
      for (double& noise : observation.noise) noise = pixel_noise_.Normal();
      const auto point = scene::ToArray(points_[i]);
      double offset[3], h[3];
      Vec<3>::Minus(point.data(), state.position.data(), offset);
      UnitQuaternion::RotateBack(state.orientation.data(), offset, h);
      observation.depth = h[2];
      if (!(h[2] > 0.0) || !camera_.Project(h, observation.pixel)) continue;
      const double noisy[2] = {observation.pixel[0] + sigma_px_ * observation.noise[0],
                               observation.pixel[1] + sigma_px_ * observation.noise[1]};
      if (camera_.Contains(observation.pixel) && camera_.Contains(noisy))
        observations.push_back(observation);
    }
    if (observations.size() > max_features_) {
      const auto was_in_previous_frame = [&](const Observation& observation) {
        return bool(was_in_previous_frame_[observation.point]);
      };
      std::stable_partition(observations.begin(), observations.end(), was_in_previous_frame);
      observations.resize(max_features_);
      std::ranges::sort(observations, {}, &Observation::point);
    }
    was_in_previous_frame_.assign(points_.size(), false);
    for (const Observation& observation : observations)
      was_in_previous_frame_[observation.point] = true;
    return observations;
  }

  void EmitObservation(const Observation& observation, Frame& frame) {
    Measurement measurement;
    measurement.timestamp = frame.timestamp;
    measurement.landmark = static_cast<std::int64_t>(observation.point);
    const double u = observation.pixel[0] + sigma_px_ * observation.noise[0];
    const double v = observation.pixel[1] + sigma_px_ * observation.noise[1];
    measurement.values = {u, v};
    if (measures_ == kStereo) {
      measurement.values.push_back(observation.pixel[0] -
                                   camera_.fx * baseline_m_ / observation.depth +
                                   sigma_px_ * observation.noise[2]);
      measurement.values.push_back(observation.pixel[1] + sigma_px_ * observation.noise[3]);
    } else if (measures_ == kDepth) {
      measurement.values.push_back(observation.depth + sigma_depth_m_ * observation.noise[2]);
    } else if (!was_seen_[observation.point] && remaining_known_ > 0) {
      --remaining_known_;
      const double sigma_m = known_sigma_ * observation.depth, variance_px = sigma_px_ * sigma_px_;
      measurement.stream = 1;
      measurement.values.push_back(observation.depth + sigma_m * observation.noise[2]);
      if (sigma_px_ > 0.0) {
        measurement.covariance = {variance_px, 0, 0, 0, variance_px, 0, 0, 0, sigma_m * sigma_m};
      }
    }
    was_seen_[observation.point] = true;
    frame.measurements.push_back(std::move(measurement));
  }

  /// Emits v = V(phi)^-1 R_WC' (r' - r) / dt and omega, with phi = omega dt. With these velocities
  /// odometry_pose moves to the next pose.
  void EmitOdometry(Frame& frame) {
    const scene::CameraState& current = trajectory_[index_];
    const scene::CameraState& next = trajectory_[index_ + 1];
    Eigen::Vector3d phi, displacement, moved;
    UnitQuaternion::Minus(next.orientation.data(), current.orientation.data(), phi.data());
    Vec<3>::Minus(next.position.data(), current.position.data(), displacement.data());
    UnitQuaternion::RotateBack(current.orientation.data(), displacement.data(), moved.data());
    const Eigen::Vector3d linear = scene::BodyFrameDisplacement(phi, moved) / dt_s_;
    Measurement measurement;
    measurement.timestamp = frame.timestamp;
    measurement.stream = odometry_stream_;
    for (const double value : linear) {
      measurement.values.push_back(value + linear_sigma_ * odometry_noise_.Normal());
    }
    for (const double value : phi) {
      measurement.values.push_back(value / dt_s_ + angular_sigma_ * odometry_noise_.Normal());
    }
    frame.measurements.push_back(std::move(measurement));
  }

  Camera camera_;
  std::vector<StreamInfo> streams_, truths_;
  std::vector<Eigen::Vector3d> points_;
  std::vector<Rectangle> surfaces_;
  std::vector<scene::CameraState> trajectory_;
  std::vector<bool> was_in_previous_frame_, was_seen_;
  std::size_t count_ = 0, index_ = 0, max_features_ = 0;
  double dt_s_ = 0.0, sigma_px_ = 0.0, baseline_m_ = 0.0, sigma_depth_m_ = 0.0;
  double image_noise_grey_ = 0.0;
  Measures measures_ = kPixel;
  int remaining_known_ = 0, odometry_stream_ = -1, keyframe_stream_ = -1;
  double known_sigma_ = 0.0, linear_sigma_ = 0.0, angular_sigma_ = 0.0;
  Random pixel_noise_, odometry_noise_, image_noise_;
  scene::Keyframes keyframes_;
};

}  // namespace

std::unique_ptr<Source> CreateScene(const SourceArguments& arguments) {
  return std::make_unique<Scene>(arguments);
}

}  // namespace alidade
