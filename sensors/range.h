// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/model/body.h"

namespace alidade {

/// Range from a body to a known point in D dimensions: ultra-wideband anchors, sonar beacons. The
/// point is a parameter of the sensor, or each measurement contains it.
///
///   model      z = |p + R l - a| + b + n,   n ~ N(0, sigma^2)
///   Jacobian   automatic differentiation               1 x roles
///   noise      R_z = sigma^2                           1x1, m^2
///
///   symbol     shape  unit    frame  meaning
///   p          D      m       world  position of the body
///   R          -      rad, -  -      attitude of the body, world_from_body: a heading for
///                                    D = 2, an orientation for D = 3; optional, else identity
///   l          D      m       body   lever arm, the position of the sensor on the body
///   a          D      m       world  the point, known
///   b          1      m       -      bias of the range
///   sigma      1      m       -      standard deviation of z; > 0
///   D          -      -       -      2 or 3
///
/// l and b are model parameter states, by default constant at 0.
///
/// Defined for  p + R l != a. Otherwise out_of_domain; outputs unchanged.
/// Source       [Groves2013] sec. 7.1.
template <int D>
struct RangeToPoint : Sensor<Vec<1>, Vec<D>, typename Body<D>::Rotation, Vec<D>, Vec<1>> {
  static constexpr std::array kRoles{
      Quantity{"position", "m", "position of the body in the world", kAxes<D>},
      Body<D>::Attitude(ALIDADE_ROLE_OPTIONAL), LeverArm<D>(),
      Quantity{"bias", "m", "bias of the range", "", ALIDADE_ROLE_OWNED}};
  static constexpr Quantity kMeasurement{"range", "m", "distance to the point"};
  using Known = Vec<D>;
  static constexpr Quantity kKnown{"point", "m", "position of the point in the world", kAxes<D>};
  static constexpr const char* kFixedKey = "point_m";

  double sigma_m;

  explicit RangeToPoint(double sigma) : sigma_m(sigma) {}
  explicit RangeToPoint(Params& p)
      : RangeToPoint(p.Positive("sigma_m", "m", "standard deviation of the range")) {}

  template <class T>
  bool Predict(const T* position, const T* attitude, const T* lever_arm, const T* bias,
               const double* point, T* z) const {
    using std::sqrt;
    T arm[D], squared(0.0);
    Body<D>::Rotate(attitude, lever_arm, arm);
    for (int i = 0; i < D; ++i) {
      const T d = position[i] + arm[i] - point[i];
      squared += d * d;
    }
    if (!(squared > T(0.0))) return false;
    z[0] = sqrt(squared) + bias[0];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, const T*, const T*, const double*, T* L) const {
    L[0] = T(sigma_m);
  }
};

}  // namespace alidade
