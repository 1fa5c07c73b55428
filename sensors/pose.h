// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/model/model.h"

namespace alidade {

/// Measured pose of a body, for example by motion capture, scan matching or another estimator.
///
///   model      z = (r + n_r, q (+) n_q),   (n_r, n_q) ~ N(0, R)
///   Jacobian   dz/d(r, q) = I                          6x6
///   noise      R = diag(sigma_r^2, sigma_q^2), or the covariance of the measurement
///                                                      6x6, m^2, m rad, rad^2
///   inverse    r = z_r
///
///   symbol     shape  unit    frame  meaning
///   r          3      m       world  position of the body
///   q          4      -       world  orientation, world_from_body
///   n_r        3      m       world  noise of the position
///   n_q        3      rad     body   noise of the orientation, q (+) n = q Exp(n)
///   sigma_r, sigma_q  3  m, rad  world, body          standard deviation for each axis; > 0
///
/// Defined everywhere.
/// Source       q (+) n and its Jacobian [Sola2017] ch. 4.
struct Pose : Sensor<Product<Vec<3>, UnitQuaternion>, Vec<3>, UnitQuaternion> {
  static constexpr std::array kRoles{
      Quantity{"position", "m", "position of the body in the world", "x,y,z"},
      Quantity{"orientation", "", "orientation of the body, world_from_body", "w,x,y,z"}};
  static constexpr Quantity kMeasurement{"pose", "", "position and orientation of the body"};
  static constexpr std::array kParts{
      Quantity{"position", "m", "position of the body in the world", "x,y,z"},
      Quantity{"orientation", "", "orientation of the body, world_from_body", "w,x,y,z"}};
  static constexpr int kInitialises = 0;

  std::array<double, 3> sigma_position_m, sigma_orientation_rad;

  Pose(const std::array<double, 3>& position_m, const std::array<double, 3>& orientation_rad)
      : sigma_position_m(position_m), sigma_orientation_rad(orientation_rad) {}
  explicit Pose(Params& p)
      : Pose(p.PerAxis<3>("sigma_position_m", "m", "standard deviation of the position", kPositive),
             p.PerAxis<3>("sigma_orientation_rad", "rad",
                          "standard deviation of the orientation about each axis of the body",
                          kPositive)) {}

  template <class T>
  bool Predict(const T* position, const T* orientation, T* z) const {
    for (int i = 0; i < 3; ++i) z[i] = position[i];
    for (int i = 0; i < 4; ++i) z[3 + i] = orientation[i];
    return true;
  }
  void Jacobian(const double*, const double*, MatrixRef J_z_position,
                MatrixRef J_z_orientation) const {
    for (int i = 0; i < 3; ++i) J_z_position(i, i) = J_z_orientation(3 + i, i) = 1.0;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, T* L) const {
    for (int i = 0; i < 3; ++i) {
      L[7 * i] = T(sigma_position_m[static_cast<std::size_t>(i)]);
      L[7 * (3 + i)] = T(sigma_orientation_rad[static_cast<std::size_t>(i)]);
    }
  }
  template <class T>
  bool Initialise(const T*, const T* z, T* position) const {
    for (int i = 0; i < 3; ++i) position[i] = z[i];
    return true;
  }
};

}  // namespace alidade
