// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/model/model.h"

namespace alidade {

/// Velocity that is zero at the times of a stream: the zero-velocity update of a body that stands.
/// The stream contains a measurement, with the value 0, only while the body stands.
///
///   model      z = x + n,   n ~ N(0, sigma^2 I)        z = 0
///   Jacobian   dz/dx = I                               N x N
///   noise      R = sigma^2 I                           N x N, unit^2
///
///   symbol     shape  unit       frame  meaning
///   z          N      unit of x  any    0 while the body stands
///   x          N      any        any    velocity, angular velocity or speed; N is 1 to 6
///   sigma      1      unit of x  any    standard deviation of x about 0; > 0
///
/// Defined everywhere.
/// Source       [Groves2013] sec. 15.3.
template <int N>
struct ZeroVelocity : Sensor<Vec<N>, Vec<N>> {
  static constexpr std::array kRoles{Quantity{"velocity", "", "velocity that is zero"}};
  static constexpr Quantity kMeasurement{"zero", "", "0 while the body stands"};

  double sigma;

  explicit ZeroVelocity(double deviation) : sigma(deviation) {}
  explicit ZeroVelocity(Params& p)
      : ZeroVelocity(p.Positive("sigma", "unit", "standard deviation of the velocity about 0")) {}

  template <class T>
  bool Predict(const T* velocity, T* z) const {
    for (int i = 0; i < N; ++i) z[i] = velocity[i];
    return true;
  }
  void Jacobian(const double*, MatrixRef J_z_velocity) const {
    for (int i = 0; i < N; ++i) J_z_velocity(i, i) = 1.0;
  }
  template <class T>
  void SqrtNoise(const T*, T* L) const {
    for (int i = 0; i < N; ++i) L[(N + 1) * i] = T(sigma);
  }
};

}  // namespace alidade
