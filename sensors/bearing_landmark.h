// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/model/body.h"

namespace alidade {

/// Bearing of a landmark in the plane: bearing-only SLAM.
///
///   model      z = atan2(h_y, h_x) (+) n,   h = R' (m - p),   n ~ N(0, sigma^2)
///   Jacobian   automatic differentiation               1 x 5
///   noise      R_z = sigma^2                           1x1, rad^2
///   inverse    m = p + R (cos z, sin z) / rho          rho: prior of the inverse distance, 1/m
///
///   symbol     shape  unit    frame  meaning
///   z          1      rad     body   bearing, counter-clockwise from the x axis of the body
///   p, R       2, 1   m, rad  world  position and heading of the body
///   m          2      m       world  landmark
///   sigma      1      rad     -      standard deviation of z; > 0
///
/// Defined for  m != p; the inverse for rho > 0. Otherwise out_of_domain; outputs unchanged.
/// Source       [Thrun2005] sec. 6.6.
struct BearingLandmark : Sensor<Angle, Vec<2>, Angle, Vec<2>> {
  static constexpr std::array kRoles{
      Quantity{"position", "m", "position of the body in the world", "x,y"}, Body<2>::Attitude(),
      Quantity{"landmark", "m", "position of the landmark in the world", "x,y",
               ALIDADE_ROLE_LANDMARK}};
  static constexpr Quantity kMeasurement{"bearing", "rad", "bearing, counter-clockwise"};
  static constexpr int kInitialises = 2, kPrior = 1;

  double sigma_rad;

  explicit BearingLandmark(double sigma) : sigma_rad(sigma) {}
  explicit BearingLandmark(Params& p)
      : BearingLandmark(p.Positive("sigma_rad", "rad", "standard deviation of the bearing")) {}

  template <class T>
  bool Predict(const T* position, const T* heading, const T* landmark, T* z) const {
    using std::atan2;
    const T difference[2] = {landmark[0] - position[0], landmark[1] - position[1]};
    T h[2];
    Body<2>::RotateBack(heading, difference, h);
    if (!(h[0] * h[0] + h[1] * h[1] > T(0.0))) return false;
    z[0] = atan2(h[1], h[0]);
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, const T*, T* L) const {
    L[0] = T(sigma_rad);
  }
  template <class T>
  bool Initialise(const T* position, const T* heading, const T* z, const T* prior,
                  T* landmark) const {
    using std::cos;
    using std::sin;
    if (!(prior[0] > T(0.0))) return false;
    const T direction[2] = {cos(z[0]), sin(z[0])};
    Body<2>::Rotate(heading, direction, landmark);
    for (int i = 0; i < 2; ++i) landmark[i] = position[i] + landmark[i] / prior[0];
    return true;
  }
};

}  // namespace alidade
