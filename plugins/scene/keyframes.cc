// SPDX-License-Identifier: Apache-2.0
#include "keyframes.h"

#include <string>
#include <utility>

#include "alidade/model/geometry.h"

namespace alidade::scene {

Keyframes::Keyframes(Params& p, std::uint64_t seed) : noise_(seed, 5) {
  interval_ = static_cast<std::size_t>(p.Integer(
      "keyframes.every_frames",
      "frames from one keyframe to the next, for stream relative_poses; 0: none", 0, 1'000'000, 0));
  if (interval_ == 0) return;
  sigma_r_ =
      p.NonNegative("keyframes.sigma_position_m", "m", "noise of a relative position, 1 sigma");
  sigma_q_ = p.NonNegative("keyframes.sigma_orientation_rad", "rad",
                           "noise of a relative orientation, 1 sigma");
  measures_previous_ = p.Flag("keyframes.to_previous",
                              "whether the pose of the previous keyframe is measured", true);
  radius_ =
      p.NumberOrNone("keyframes.closure_radius_m", "m",
                     "largest distance of a keyframe that closes a loop; none: no loops", kPositive)
          .value_or(0.0);
  min_keyframes_between_ = static_cast<std::size_t>(p.Integer(
      "keyframes.closure_after",
      "minimum number of keyframes between the two keyframes that close a loop", 1, 1'000'000, 50));
}

void Keyframes::Emit(std::size_t index, const CameraState& state, int stream, std::size_t first,
                     Frame& frame) {
  if (index % interval_ != 0) return;
  if (measures_previous_ && !keyframes_.empty())
    EmitRelative(state, keyframes_.size() - 1, stream, first, frame);
  if (const std::size_t closure = Nearest(state); closure < keyframes_.size()) {
    EmitRelative(state, closure, stream, first, frame);
  }
  Measurement self{frame.timestamp,
                   stream,
                   static_cast<std::int64_t>(first + keyframes_.size()),
                   {0, 0, 0, 1, 0, 0, 0},
                   std::vector<double>(36, 0.0)};
  frame.measurements.push_back(std::move(self));
  keyframes_.push_back(state);
}

std::size_t Keyframes::Nearest(const CameraState& state) const {
  std::size_t nearest = keyframes_.size();
  double smallest = radius_ * radius_;
  for (std::size_t j = 0; radius_ > 0.0 && j + min_keyframes_between_ < keyframes_.size(); ++j) {
    double offset[3];
    Vec<3>::Minus(keyframes_[j].position.data(), state.position.data(), offset);
    const double squared = offset[0] * offset[0] + offset[1] * offset[1] + offset[2] * offset[2];
    if (squared > smallest) continue;
    smallest = squared;
    nearest = j;
  }
  return nearest;
}

void Keyframes::EmitRelative(const CameraState& state, std::size_t j, int stream, std::size_t first,
                             Frame& frame) {
  const CameraState& keyframe = keyframes_[j];
  double offset[3], rotation[4], n[3];
  Measurement measurement{
      frame.timestamp, stream, static_cast<std::int64_t>(first + j), std::vector<double>(7), {}};
  double* const z = measurement.values.data();
  Vec<3>::Minus(keyframe.position.data(), state.position.data(), offset);
  UnitQuaternion::RotateBack(state.orientation.data(), offset, z);
  for (int i = 0; i < 3; ++i) z[i] += sigma_r_ * noise_.Normal();
  const double inverse[4] = {state.orientation[0], -state.orientation[1], -state.orientation[2],
                             -state.orientation[3]};
  UnitQuaternion::Multiply(inverse, keyframe.orientation.data(), rotation);
  for (double& value : n) value = sigma_q_ * noise_.Normal();
  UnitQuaternion::Plus(rotation, n, z + 3);
  frame.measurements.push_back(std::move(measurement));
}

}  // namespace alidade::scene
