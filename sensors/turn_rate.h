// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/model/body.h"

namespace alidade {

/// Turn rate of a body in the plane (D = 2) or its angular velocity in space (D = 3), measured by a
/// gyroscope.
///
///   model      z = (1 + s) B' omega + b + n,   n ~ N(0, diag(sigma^2))
///   Jacobian   automatic differentiation               1 x 3, or 3 x 12
///   noise      R = diag(sigma^2), or the covariance of the measurement         rad^2/s^2
///   inverse    omega = B (z - b) / (1 + s)
///
///   symbol     shape  unit    frame  meaning
///   z          1, 3   rad/s   sensor measured turn rate or angular velocity
///   omega      1, 3   rad/s   body   turn rate or angular velocity of the body
///   b          1, 3   rad/s   sensor bias
///   s          1, 3   -       sensor scale error of each axis
///   B          4      -       -      mounting of the sensor, body_from_sensor; only for D = 3
///   sigma      1      rad/s   sensor standard deviation for each axis; > 0
///
/// b, s and B are model parameter states, by default constant at the neutral element.
///
/// Defined everywhere. The inverse is defined for  s > -1.
/// Source       [Groves2013] sec. 4.4.
template <int D>
struct TurnRate;

template <>
struct TurnRate<2> : Sensor<Vec<1>, Vec<1>, Vec<1>, Vec<1>> {
  static constexpr std::array kRoles{
      Body<2>::AngularVelocity(),
      Quantity{"bias", "rad/s", "bias of the gyroscope", "", ALIDADE_ROLE_OWNED},
      Quantity{"scale_error", "", "scale error of the gyroscope", "", ALIDADE_ROLE_OWNED}};
  static constexpr Quantity kMeasurement{"turn_rate", "rad/s", "turn rate, counter-clockwise"};
  static constexpr int kInitialises = 0;

  double sigma_rad_s;

  explicit TurnRate(double sigma) : sigma_rad_s(sigma) {}
  explicit TurnRate(Params& p)
      : TurnRate(p.Positive("sigma_rad_s", "rad/s", "standard deviation of the turn rate")) {}

  template <class T>
  bool Predict(const T* omega, const T* bias, const T* scale_error, T* z) const {
    z[0] = (1.0 + scale_error[0]) * omega[0] + bias[0];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, const T*, T* L) const {
    L[0] = T(sigma_rad_s);
  }
  template <class T>
  bool Initialise(const T* bias, const T* scale_error, const T* z, T* omega) const {
    if (!(scale_error[0] > T(-1.0))) return false;
    omega[0] = (z[0] - bias[0]) / (1.0 + scale_error[0]);
    return true;
  }
};

template <>
struct TurnRate<3> : Sensor<Vec<3>, Vec<3>, Vec<3>, Vec<3>, UnitQuaternion> {
  static constexpr std::array kRoles{
      Body<3>::AngularVelocity(),
      Quantity{"bias", "rad/s", "bias of the gyroscope", "x,y,z", ALIDADE_ROLE_OWNED},
      Quantity{"scale_error", "", "scale error of each axis", "x,y,z", ALIDADE_ROLE_OWNED},
      Body<3>::Mounting()};
  static constexpr Quantity kMeasurement{"angular_velocity", "rad/s",
                                         "angular velocity in the frame of the sensor", "x,y,z"};
  static constexpr int kInitialises = 0;

  std::array<double, 3> sigma_rad_s;

  explicit TurnRate(const std::array<double, 3>& sigma) : sigma_rad_s(sigma) {}
  explicit TurnRate(Params& p)
      : TurnRate(p.PerAxis<3>("sigma_rad_s", "rad/s", "standard deviation of the angular velocity",
                              kPositive)) {}

  template <class T>
  bool Predict(const T* omega, const T* bias, const T* scale_error, const T* mounting, T* z) const {
    Body<3>::RotateBack(mounting, omega, z);
    for (int i = 0; i < 3; ++i) z[i] = (1.0 + scale_error[i]) * z[i] + bias[i];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, const T*, const T*, T* L) const {
    for (int i = 0; i < 3; ++i) L[4 * i] = T(sigma_rad_s[static_cast<std::size_t>(i)]);
  }
  template <class T>
  bool Initialise(const T* bias, const T* scale_error, const T* mounting, const T* z,
                  T* omega) const {
    T in_sensor[3];
    for (int i = 0; i < 3; ++i) {
      if (!(scale_error[i] > T(-1.0))) return false;
      in_sensor[i] = (z[i] - bias[i]) / (1.0 + scale_error[i]);
    }
    Body<3>::Rotate(mounting, in_sensor, omega);
    return true;
  }
};

}  // namespace alidade
