// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/model/model.h"

namespace alidade {

/// Pseudorange from a receiver to a transmitter, such as a satellite or a radio beacon. Each
/// measurement contains the position of its transmitter.
///
///   model      z = |p - s| + b + n,   n ~ N(0, sigma^2)
///   Jacobian   dz/dp = (p - s)' / |p - s|,  dz/db = 1  1x3, 1x1
///   noise      R = sigma^2                             1x1, m^2
///
///   symbol     shape  unit    frame  meaning
///   p          3      m       world  position of the receiver
///   s          3      m       world  position of the transmitter at the time of sending, known
///   b          1      m       -      clock bias of the receiver times the speed of light: a model
///                                    parameter state. Default: a random walk of 1 m / sqrt(s) with
///                                    the prior N(0, (1e5 m)^2)
///   sigma      1      m       -      standard deviation of z; > 0
///
/// Defined for  p != s. Otherwise out_of_domain; outputs unchanged.
/// Source       [Groves2013] sec. 9.4.
struct Pseudorange : Sensor<Vec<1>, Vec<3>, Vec<1>> {
  static constexpr std::array kRoles{
      Quantity{"position", "m", "position of the receiver in the world", "x,y,z"},
      Quantity{"clock_bias", "m", "clock bias of the receiver times the speed of light", "",
               ALIDADE_ROLE_OWNED}};
  static constexpr Quantity kMeasurement{"pseudorange", "m",
                                         "distance to the transmitter plus clock bias"};
  using Known = Vec<3>;
  static constexpr Quantity kKnown{"transmitter", "m", "position of the transmitter in the world",
                                   "x,y,z"};

  double sigma_m;

  explicit Pseudorange(double sigma) : sigma_m(sigma) {}
  explicit Pseudorange(Params& p)
      : Pseudorange(p.Positive("sigma_m", "m", "standard deviation of the pseudorange")) {}

  Owned OwnedRole(int) const { return Owned::RandomWalk({0.0}, {1e5}, {1.0}); }

  template <class T>
  bool Predict(const T* position, const T* clock_bias, const double* transmitter, T* z) const {
    using std::sqrt;
    T squared(0.0);
    for (int i = 0; i < 3; ++i) {
      const T d = position[i] - transmitter[i];
      squared += d * d;
    }
    if (!(squared > T(0.0))) return false;
    z[0] = sqrt(squared) + clock_bias[0];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, const double*, T* L) const {
    L[0] = T(sigma_m);
  }
};

}  // namespace alidade
