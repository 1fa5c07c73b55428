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

/// Relative poses between frames of a trajectory. Every so many frames one is a keyframe k:
///
///   z = (R_k' (r_j - r_k) + n_r, (q_k^-1 q_j) (+) n_q)   of the keyframe before, j = k - 1, unless
///                                                        to_previous is false; and of the nearest
///                                                        one of those that are old enough and near
///                                                        enough: a loop is closed
///   z = (0, 1), without noise                            of k itself: that is where it is
///
/// with n_r ~ N(0, sigma_r^2), n_q ~ N(0, sigma_q^2). The landmark of a measurement is j, or k,
/// plus `first`.
class Keyframes {
 public:
  Keyframes(Params& p, std::uint64_t seed);

  bool any() const { return every_ > 0; }
  /// How many there are so far, and where they are.
  std::size_t size() const { return keyframes_.size(); }
  const std::array<double, 3>& position(std::size_t k) const { return keyframes_[k].position; }

  /// The measurements of frame `index`, of that stream; the frames come in turn. The landmarks are
  /// numbered from `first` on.
  void Emit(std::size_t index, const CameraState& now, int stream, std::size_t first, Frame& frame);

 private:
  /// Of the old ones within the radius; how many there are where there is none.
  std::size_t Nearest(const CameraState& now) const;

  void EmitRelative(const CameraState& now, std::size_t j, int stream, std::size_t first,
                    Frame& frame);

  std::size_t every_ = 0, apart_ = 0;
  bool to_previous_ = true;
  double sigma_r_ = 0.0, sigma_q_ = 0.0, radius_ = 0.0;
  Random noise_;
  std::vector<CameraState> keyframes_;
};

}  // namespace alidade::scene
