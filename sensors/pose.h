// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

#include "alidade/model/body.h"

namespace alidade {

/// Measured pose of a body in the plane (D = 2) or in space (D = 3), for example by motion capture,
/// scan matching or another estimator.
///
///   model      z = (r + n_r, q (+) n_q),   (n_r, n_q) ~ N(0, R)
///   Jacobian   dz/d(r, q) = I                          3x3, 6x6
///   noise      R = diag(sigma_r^2, sigma_q^2), or the covariance of the measurement
///                                                      3x3, 6x6, m^2, m rad, rad^2
///   inverse    r = z_r
///
///   symbol     shape  unit    frame  meaning
///   r          2, 3   m       world  position of the body
///   q          1, 4   rad, -  world  attitude, world_from_body: a heading in the plane, an
///                                    orientation in space
///   n_r        2, 3   m       world  noise of the position
///   n_q        1, 3   rad     body   noise of the attitude, q (+) n = q Exp(n)
///   sigma_r, sigma_q  -  m, rad  world, body          standard deviation for each axis; > 0
///
/// Defined everywhere.
/// Source       q (+) n and its Jacobian [Sola2017] ch. 4.
template <int D>
struct Pose
    : Sensor<Product<Vec<D>, typename Body<D>::Rotation>, Vec<D>, typename Body<D>::Rotation> {
  using Rotation = typename Body<D>::Rotation;
  static constexpr Quantity kPosition{"position", "m", "position of the body in the world",
                                      kAxes<D>};
  static constexpr std::array kRoles{kPosition, Body<D>::Attitude()};
  static constexpr Quantity kMeasurement{"pose", "", "position and attitude of the body"};
  static constexpr std::array kParts{kPosition, Body<D>::Attitude()};
  static constexpr int kInitialises = 0;

  PoseNoise<D> sigma;

  Pose(const std::array<double, D>& position_m,
       const std::array<double, Rotation::kTangent>& attitude_rad)
      : sigma{position_m, attitude_rad} {}
  explicit Pose(Params& p) : sigma(PoseNoise<D>::Read(p)) {}

  template <class T>
  bool Predict(const T* position, const T* attitude, T* z) const {
    std::copy_n(position, D, z);
    std::copy_n(attitude, Rotation::kAmbient, z + D);
    return true;
  }
  void Jacobian(const double*, const double*, MatrixRef J_z_position,
                MatrixRef J_z_attitude) const {
    for (int i = 0; i < D; ++i) J_z_position(i, i) = 1.0;
    for (int i = 0; i < Rotation::kTangent; ++i) J_z_attitude(D + i, i) = 1.0;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, T* L) const {
    sigma.WriteSqrtNoise(L);
  }
  template <class T>
  bool Initialise(const T*, const T* z, T* position) const {
    std::copy_n(z, D, position);
    return true;
  }
};

}  // namespace alidade
