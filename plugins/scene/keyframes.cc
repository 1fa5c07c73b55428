// SPDX-License-Identifier: Apache-2.0
#include "keyframes.h"

#include <string>
#include <utility>

#include "alidade/model/geometry.h"

namespace alidade::scene {

Keyframes::Keyframes(Params& p, std::uint64_t seed) : noise_(seed, 5) {
  every_ = static_cast<std::size_t>(p.Integer(
      "keyframes.every_frames",
      "frames from one keyframe to the next, for stream relative_poses; 0: none", 0, 1'000'000, 0));
  if (every_ == 0) return;
  sigma_r_ = p.NonNegative("keyframes.sigma_position_m", "m", "noise of a relative pose, 1 sigma");
  sigma_q_ = p.NonNegative("keyframes.sigma_orientation_rad", "rad", "likewise");
  to_previous_ =
      p.Flag("keyframes.to_previous", "whether the way to the keyframe before is measured", true);
  radius_ = p.NonNegative("keyframes.closure_radius_m", "m",
                          "how near a keyframe has to be for a loop to be closed; 0: never", 0.0);
  apart_ = static_cast<std::size_t>(p.Integer(
      "keyframes.closure_after", "keyframes that lie between, at least", 1, 1'000'000, 50));
}

void Keyframes::Emit(std::size_t index, const CameraState& now, int stream, std::size_t first,
                     Frame& frame) {
  if (index % every_ != 0) return;
  if (to_previous_ && !keyframes_.empty())
    EmitRelative(now, keyframes_.size() - 1, stream, first, frame);
  if (const std::size_t near = Nearest(now); near < keyframes_.size()) {
    EmitRelative(now, near, stream, first, frame);
  }
  Measurement self{frame.timestamp,
                   stream,
                   static_cast<std::int64_t>(first + keyframes_.size()),
                   {0, 0, 0, 1, 0, 0, 0},
                   std::vector<double>(36, 0.0)};
  frame.measurements.push_back(std::move(self));
  keyframes_.push_back(now);
}

std::size_t Keyframes::Nearest(const CameraState& now) const {
  std::size_t nearest = keyframes_.size();
  double least = radius_ * radius_;
  for (std::size_t j = 0; radius_ > 0.0 && j + apart_ < keyframes_.size(); ++j) {
    double way[3];
    Vec<3>::Minus(keyframes_[j].position.data(), now.position.data(), way);
    const double squared = way[0] * way[0] + way[1] * way[1] + way[2] * way[2];
    if (squared > least) continue;
    least = squared;
    nearest = j;
  }
  return nearest;
}

void Keyframes::EmitRelative(const CameraState& now, std::size_t j, int stream, std::size_t first,
                             Frame& frame) {
  const CameraState& then = keyframes_[j];
  double way[3], turn[4], n[3];
  Measurement measurement{
      frame.timestamp, stream, static_cast<std::int64_t>(first + j), std::vector<double>(7), {}};
  double* const z = measurement.values.data();
  Vec<3>::Minus(then.position.data(), now.position.data(), way);
  UnitQuaternion::RotateBack(now.orientation.data(), way, z);
  for (int i = 0; i < 3; ++i) z[i] += sigma_r_ * noise_.Normal();
  const double back[4] = {now.orientation[0], -now.orientation[1], -now.orientation[2],
                          -now.orientation[3]};
  UnitQuaternion::Multiply(back, then.orientation.data(), turn);
  for (double& one : n) one = sigma_q_ * noise_.Normal();
  UnitQuaternion::Plus(turn, n, z + 3);
  frame.measurements.push_back(std::move(measurement));
}

}  // namespace alidade::scene
