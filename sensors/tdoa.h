// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/model/body.h"

namespace alidade {

/// Time difference of arrival, as a difference of ranges from a body to two known anchors in D
/// dimensions. The anchors are a parameter of the sensor, or each measurement contains them.
///
///   model      z = |p - a| - |p - c| + b + n,   n ~ N(0, sigma^2)
///   Jacobian   automatic differentiation               1 x (D + 1)
///   noise      R = sigma^2                             1x1, m^2
///
///   symbol     shape  unit    frame  meaning
///   z          1      m       -      difference of arrival times, times the speed of the signal
///   p          D      m       world  position of the body; D is 2 or 3
///   a, c       D      m       world  anchor and reference anchor, known
///   b          1      m       -      bias, such as a clock error: a model parameter state,
///                                    default: constant at 0
///   sigma      1      m       -      standard deviation of z; > 0
///
/// Defined for  p != a and p != c. Otherwise out_of_domain; outputs unchanged.
/// Source       [Groves2013] sec. 7.1.4.
template <int D>
struct Tdoa : Sensor<Vec<1>, Vec<D>, Vec<1>> {
  static constexpr std::array kRoles{
      Quantity{"position", "m", "position of the body in the world", kAxes<D>},
      Quantity{"bias", "m", "bias of the difference", "", ALIDADE_ROLE_OWNED}};
  static constexpr Quantity kMeasurement{"range_difference", "m",
                                         "distance to the anchor minus that to the reference"};
  using Known = Vec<2 * D>;
  static constexpr Quantity kKnown{
      "anchors", "m", "positions of the anchor and of the reference anchor in the world",
      D == 2 ? "x,y,reference_x,reference_y" : "x,y,z,reference_x,reference_y,reference_z"};
  static constexpr const char* kFixedKey = "anchors_m";

  double sigma_m;

  explicit Tdoa(double sigma) : sigma_m(sigma) {}
  explicit Tdoa(Params& p)
      : Tdoa(p.Positive("sigma_m", "m", "standard deviation of the range difference")) {}

  template <class T>
  bool Predict(const T* position, const T* bias, const double* anchors, T* z) const {
    using std::sqrt;
    T squared(0.0), squared_reference(0.0);
    for (int i = 0; i < D; ++i) {
      const T d = position[i] - anchors[i], e = position[i] - anchors[D + i];
      squared += d * d;
      squared_reference += e * e;
    }
    if (!(squared > T(0.0)) || !(squared_reference > T(0.0))) return false;
    z[0] = sqrt(squared) - sqrt(squared_reference) + bias[0];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, const double*, T* L) const {
    L[0] = T(sigma_m);
  }
};

}  // namespace alidade
