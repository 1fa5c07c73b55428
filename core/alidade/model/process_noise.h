// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>

#include "alidade/model/model.h"

/// Process noise that several motion models share.
namespace alidade {

/// Writes the factor of the noise of a position and its velocity that a white acceleration causes:
///
///   Q = sigma^2 [dt^3/3 dt^2/2; dt^2/2 dt]
///
/// `position` and `velocity` are the rows of the two noise inputs. `sigma` is the root of the
/// spectral density of the acceleration, for example in m/s^1.5.
inline void SetWhiteAcceleration(double sigma, double dt_s, int position, int velocity,
                                 MatrixRef l) {
  const double root = sigma * std::sqrt(dt_s);
  l(position, position) = root * dt_s / std::sqrt(3.0);
  l(velocity, position) = root * std::sqrt(3.0) / 2.0;
  l(velocity, velocity) = root / 2.0;
}

/// White linear and angular acceleration of a body in space. For each axis, the noise of a position
/// and its velocity has the form of SetWhiteAcceleration.
struct WhiteBodyAcceleration {
  std::array<double, 3> linear;   ///< root of the spectral density for each axis, m/s^1.5
  std::array<double, 3> angular;  ///< root of the spectral density for each axis, rad/s^1.5

  /// Reads `noise.linear_acceleration` and `noise.angular_acceleration`.
  static WhiteBodyAcceleration Read(Params& p) {
    return {p.PerAxis<3>("noise.linear_acceleration", "m/s^1.5",
                         "root of the spectral density of the acceleration", kNonNegative),
            p.PerAxis<3>("noise.angular_acceleration", "rad/s^1.5",
                         "root of the spectral density of the angular acceleration", kNonNegative)};
  }
  /// Writes the factor of the covariance, 12 x 12, of the noise of the position, orientation,
  /// velocity and angular velocity.
  void SqrtQ(double dt_s, MatrixRef l) const {
    for (int i = 0; i < 3; ++i) {
      SetWhiteAcceleration(linear[static_cast<std::size_t>(i)], dt_s, i, 6 + i, l);
      SetWhiteAcceleration(angular[static_cast<std::size_t>(i)], dt_s, 3 + i, 9 + i, l);
    }
  }
};

/// Noise of N control inputs that are constant over dt.
///
///   continuous  w ~ N(0, diag(sigma^2) / dt): the mean over dt of white noise. sigma is the root
///               of its spectral density, in the unit of the input times s^0.5
///   discrete    w ~ N(0, diag(sigma^2)): an error that is constant between two updates. sigma has
///               the unit of the input
template <int N>
struct InputNoise {
  NoiseKind kind;
  std::array<double, N> sigma;

  /// Reads `noise.kind`.
  static NoiseKind ReadKind(Params& p) {
    const int index = p.Choice("noise.kind", {"continuous", "discrete"},
                               "white noise of the control input, or an error that is constant "
                               "between updates",
                               0);
    return index == 1 ? NoiseKind::kDiscrete : NoiseKind::kContinuous;
  }
  /// Writes the factor of the covariance of w, N x N.
  void SqrtQ(double dt_s, MatrixRef l) const {
    double scale = 1.0;
    if (kind == NoiseKind::kContinuous) scale = dt_s > 0.0 ? 1.0 / std::sqrt(dt_s) : 0.0;
    for (int i = 0; i < N; ++i) l(i, i) = scale * sigma[static_cast<std::size_t>(i)];
  }
};

}  // namespace alidade
