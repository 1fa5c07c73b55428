// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/model/body.h"

namespace alidade {

/// Speed of a body, the length of its velocity in D dimensions: a pitot tube, a speedometer.
///
///   model      z = (1 + s) |v| + b + n,   n ~ N(0, sigma^2)
///   Jacobian   automatic differentiation               1 x (D + 2)
///   noise      R = sigma^2                             1x1, m^2/s^2
///
///   symbol     shape  unit    frame  meaning
///   z          1      m/s     -      speed
///   v          D      m/s     any    velocity of the body; D is 1 to 3
///   s          1      -       -      scale error: a model parameter state, default: constant at 0
///   b          1      m/s     -      bias: a model parameter state, default: constant at 0
///   sigma      1      m/s     -      standard deviation of z; > 0
///
/// Defined for  v != 0. Otherwise out_of_domain; outputs unchanged.
/// Source       [Groves2013] sec. 6.3.
template <int D>
struct Speed : Sensor<Vec<1>, Vec<D>, Vec<1>, Vec<1>> {
  static constexpr std::array kRoles{
      Quantity{"velocity", "m/s", "velocity of the body", kAxes<D>},
      Quantity{"scale_error", "", "scale error of the speed", "", ALIDADE_ROLE_OWNED},
      Quantity{"bias", "m/s", "bias of the speed", "", ALIDADE_ROLE_OWNED}};
  static constexpr Quantity kMeasurement{"speed", "m/s", "speed of the body"};

  double sigma_m_s;

  explicit Speed(double sigma) : sigma_m_s(sigma) {}
  explicit Speed(Params& p)
      : Speed(p.Positive("sigma_m_s", "m/s", "standard deviation of the speed")) {}

  template <class T>
  bool Predict(const T* velocity, const T* scale_error, const T* bias, T* z) const {
    using std::sqrt;
    T squared(0.0);
    for (int i = 0; i < D; ++i) squared += velocity[i] * velocity[i];
    if (!(squared > T(0.0))) return false;
    z[0] = (1.0 + scale_error[0]) * sqrt(squared) + bias[0];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, const T*, T* L) const {
    L[0] = T(sigma_m_s);
  }
};

}  // namespace alidade
