// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/model/body.h"

namespace alidade {

/// Position of a point on a body, in the plane (D = 2) or in space (D = 3): a GNSS fix, an
/// ultra-wideband fix, the position of a marker.
///
///   model      z = p + R l + n,   n ~ N(0, diag(sigma^2))
///   Jacobian   automatic differentiation               D x (D + attitude + D)
///   noise      R_z = diag(sigma^2), or the covariance of the measurement       D x D, m^2
///   inverse    p = z - R l
///
///   symbol     shape  unit    frame  meaning
///   z          D      m       world  position of the sensor
///   p          D      m       world  position of the body
///   R          -      rad, -  -      attitude of the body, world_from_body: a heading for
///                                    D = 2, an orientation for D = 3; optional, else identity
///   l          D      m       body   lever arm, the position of the sensor on the body: a model
///                                    parameter state, by default constant at 0
///   sigma      1      m       world  standard deviation for each axis; > 0
///
/// Defined everywhere.
/// Source       lever arm [Groves2013] sec. 14.3.2.
template <int D>
struct Position : Sensor<Vec<D>, Vec<D>, typename Body<D>::Rotation, Vec<D>> {
  static constexpr std::array kRoles{
      Quantity{"position", "m", "position of the body in the world", kAxes<D>},
      Body<D>::Attitude(ALIDADE_ROLE_OPTIONAL), LeverArm<D>()};
  static constexpr Quantity kMeasurement{"position", "m", "position of the sensor in the world",
                                         kAxes<D>};
  static constexpr int kInitialises = 0;

  std::array<double, D> sigma_m;

  explicit Position(const std::array<double, D>& sigma) : sigma_m(sigma) {}
  explicit Position(Params& p)
      : Position(p.PerAxis<D>("sigma_m", "m", "standard deviation of the position", kPositive)) {}

  template <class T>
  bool Predict(const T* position, const T* attitude, const T* lever_arm, T* z) const {
    Body<D>::Rotate(attitude, lever_arm, z);
    for (int i = 0; i < D; ++i) z[i] += position[i];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, const T*, T* L) const {
    for (int i = 0; i < D; ++i) L[(D + 1) * i] = T(sigma_m[static_cast<std::size_t>(i)]);
  }
  template <class T>
  bool Initialise(const T* attitude, const T* lever_arm, const T* z, T* position) const {
    Body<D>::Rotate(attitude, lever_arm, position);
    for (int i = 0; i < D; ++i) position[i] = z[i] - position[i];
    return true;
  }
};

}  // namespace alidade
