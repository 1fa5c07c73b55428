// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/model/model.h"

namespace alidade {

/// Rate of a pseudorange, from the Doppler shift of a transmitter such as a satellite. Each
/// measurement contains the position and velocity of its transmitter.
///
///   model      z = e' (v - w) + d + n,   e = (p - s) / |p - s|,   n ~ N(0, sigma^2)
///   Jacobian   automatic differentiation               1 x 7
///   noise      R = sigma^2                             1x1, m^2/s^2
///
///   symbol     shape  unit    frame  meaning
///   z          1      m/s     -      rate of the pseudorange
///   p, v       3      m, m/s  world  position and velocity of the receiver
///   s, w       3      m, m/s  world  position and velocity of the transmitter, known
///   d          1      m/s     -      clock drift of the receiver times the speed of light: a model
///                                    parameter state. Default: a random walk of 0.1 m/s / sqrt(s)
///                                    with the prior N(0, (1e3 m/s)^2)
///   sigma      1      m/s     -      standard deviation of z; > 0
///
/// Defined for  p != s. Otherwise out_of_domain; outputs unchanged.
/// Source       [Groves2013] sec. 9.4.
struct PseudorangeRate : Sensor<Vec<1>, Vec<3>, Vec<3>, Vec<1>> {
  static constexpr std::array kRoles{
      Quantity{"position", "m", "position of the receiver in the world", "x,y,z"},
      Quantity{"velocity", "m/s", "velocity of the receiver in the world", "x,y,z"},
      Quantity{"clock_drift", "m/s", "clock drift of the receiver times the speed of light", "",
               ALIDADE_ROLE_OWNED}};
  static constexpr Quantity kMeasurement{"pseudorange_rate", "m/s", "rate of the pseudorange"};
  using Known = Vec<6>;
  static constexpr Quantity kKnown{
      "transmitter", "", "position in m and velocity in m/s of the transmitter", "x,y,z,vx,vy,vz"};

  double sigma_m_s;

  explicit PseudorangeRate(double sigma) : sigma_m_s(sigma) {}
  explicit PseudorangeRate(Params& p)
      : PseudorangeRate(p.Positive("sigma_m_s", "m/s", "standard deviation of the rate")) {}

  Owned OwnedRole(int) const { return Owned::RandomWalk({0.0}, {1e3}, {0.1}); }

  template <class T>
  bool Predict(const T* position, const T* velocity, const T* clock_drift,
               const double* transmitter, T* z) const {
    using std::sqrt;
    T squared(0.0), product(0.0);
    for (int i = 0; i < 3; ++i) {
      const T d = position[i] - transmitter[i];
      squared += d * d;
      product += d * (velocity[i] - transmitter[3 + i]);
    }
    if (!(squared > T(0.0))) return false;
    z[0] = product / sqrt(squared) + clock_drift[0];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, const T*, const double*, T* L) const {
    L[0] = T(sigma_m_s);
  }
};

}  // namespace alidade
