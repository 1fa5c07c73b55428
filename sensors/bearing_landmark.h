// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/model/body.h"

namespace alidade {

/// Landmark in the plane, represented by its coordinates m.
struct PlanarXyz {
  using Space = Vec<2>;
  static constexpr Quantity kRole{"landmark", "m", "position of the landmark in the world", "x,y",
                                  ALIDADE_ROLE_LANDMARK};

  /// Computes m - p.
  template <class T>
  static void DifferenceTo(const T* landmark, const T* p, T* difference) {
    for (int i = 0; i < 2; ++i) difference[i] = landmark[i] - p[i];
  }
  /// Computes the landmark on the ray from p in the direction theta. Returns false unless rho > 0.
  template <class T>
  static bool Place(const T* p, const T& theta, const T& rho, T* landmark) {
    using std::cos;
    using std::sin;
    if (!(rho > T(0.0))) return false;
    landmark[0] = p[0] + cos(theta) / rho;
    landmark[1] = p[1] + sin(theta) / rho;
    return true;
  }
};

/// Landmark in the plane, represented by the position a from which it was first observed, the
/// direction theta of the ray and the inverse distance rho along the ray. A bearing is almost
/// linear in these elements even if the distance is unknown: m = a + (cos theta, sin theta) / rho.
struct PlanarInverseDepth {
  using Space = Vec<4>;
  static constexpr Quantity kRole{"landmark", "",
                                  "anchor in m, direction in rad, inverse distance in 1/m",
                                  "x,y,theta,rho", ALIDADE_ROLE_LANDMARK};

  /// Computes rho (m - p), which is finite for a point at infinity.
  template <class T>
  static void DifferenceTo(const T* landmark, const T* p, T* difference) {
    using std::cos;
    using std::sin;
    difference[0] = landmark[3] * (landmark[0] - p[0]) + cos(landmark[2]);
    difference[1] = landmark[3] * (landmark[1] - p[1]) + sin(landmark[2]);
  }
  /// Computes the landmark on the ray from p in the direction theta.
  template <class T>
  static bool Place(const T* p, const T& theta, const T& rho, T* landmark) {
    landmark[0] = p[0];
    landmark[1] = p[1];
    landmark[2] = theta;
    landmark[3] = rho;
    return true;
  }
};

/// Bearing of a landmark in the plane: bearing-only SLAM. The landmark is represented by its
/// coordinates (PlanarXyz), or by its inverse distance (PlanarInverseDepth).
///
///   model      z = atan2(h_y, h_x) (+) n,   h = R' (m - p) or rho R' (m - p),   n ~ N(0, sigma^2)
///              m = a + (cos theta, sin theta) / rho    by its inverse distance
///   Jacobian   automatic differentiation               1 x 5, 1 x 7
///   noise      R_z = sigma^2                           1x1, rad^2
///   inverse    a = p,   theta = R + z,   rho: prior of the inverse distance, 1/m
///
///   symbol     shape  unit    frame  meaning
///   z          1      rad     body   bearing, counter-clockwise from the x axis of the body
///   p, R       2, 1   m, rad  world  position and heading of the body
///   m          2      m       world  landmark
///   a, theta   2, 1   m, rad  world  anchor, and direction of the ray from the anchor
///   rho        1      1/m     -      inverse distance from the anchor
///   sigma      1      rad     -      standard deviation of z; > 0
///
/// Defined for  h != 0; the inverse by coordinates for rho > 0. Otherwise out_of_domain; outputs
///              unchanged.
/// Source       [Thrun2005] sec. 6.6; inverse distance [Civera2008] sec. II-B, here in the plane.
template <class Landmark>
struct BearingLandmark : Sensor<Angle, Vec<2>, Angle, typename Landmark::Space> {
  static constexpr std::array kRoles{
      Quantity{"position", "m", "position of the body in the world", "x,y"}, Body<2>::Attitude(),
      Landmark::kRole};
  static constexpr Quantity kMeasurement{"bearing", "rad", "bearing, counter-clockwise"};
  static constexpr int kInitialises = 2, kPrior = 1;

  double sigma_rad;

  explicit BearingLandmark(double sigma) : sigma_rad(sigma) {}
  explicit BearingLandmark(Params& p)
      : BearingLandmark(p.Positive("sigma_rad", "rad", "standard deviation of the bearing")) {}

  template <class T>
  bool Predict(const T* position, const T* heading, const T* landmark, T* z) const {
    using std::atan2;
    T difference[2], h[2];
    Landmark::DifferenceTo(landmark, position, difference);
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
    return Landmark::Place(position, T(heading[0] + z[0]), prior[0], landmark);
  }
};

}  // namespace alidade
