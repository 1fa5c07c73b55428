// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "alidade/base/random.h"
#include "alidade/estimation/frame.h"
#include "alidade/model/params.h"
#include "trajectory.h"

namespace alidade::scene {

/// Simulates relative poses between keyframes of a trajectory. Every `every_frames`-th frame is a
/// keyframe. Keyframe k has the measurements
///
///   z = (R_k' (r_j - r_k) + n_r, (q_k^-1 q_j) (+) n_q)   if j is the previous keyframe, k - 1, and
///                                                        to_previous is true; or if j closes a
///                                                        loop: it is the nearest keyframe that is
///                                                        old and near enough
///   z = (0, 1), without noise                            if j = k; defines the pose of k
///
/// with n_r ~ N(0, sigma_r^2), n_q ~ N(0, sigma_q^2). The landmark of a measurement has the id
/// `first` + j.
class Keyframes {
 public:
  Keyframes(Params& p, std::uint64_t seed);

  bool is_enabled() const { return interval_ > 0; }
  /// Returns the number of keyframes so far.
  std::size_t size() const { return keyframes_.size(); }
  const std::array<double, 3>& position(std::size_t k) const { return keyframes_[k].position; }

  /// Appends the measurements of frame `index` to stream `stream` of `frame`. The caller must call
  /// this function for each frame, in order. Ids of landmarks start at `first`.
  void Emit(std::size_t index, const CameraState& state, int stream, std::size_t first,
            Frame& frame);

 private:
  /// Returns the index of the nearest keyframe that is within the radius and old enough. Returns
  /// size() if there is no such keyframe.
  std::size_t Nearest(const CameraState& state) const;

  void EmitRelative(const CameraState& state, std::size_t j, int stream, std::size_t first,
                    Frame& frame);

  std::size_t interval_ = 0, min_keyframes_between_ = 0;
  bool measures_previous_ = true;
  double sigma_r_ = 0.0, sigma_q_ = 0.0, radius_ = 0.0;
  Random noise_;
  std::vector<CameraState> keyframes_;
};

}  // namespace alidade::scene
