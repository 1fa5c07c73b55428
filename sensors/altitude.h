// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/model/body.h"

namespace alidade {

/// Altitude of a body, measured as a height or by a barometer. The body has a height (H = 1) or a
/// position (H = 3), whose z axis points upwards.
///
///   model      z = h + b + n                           measures: height
///              z = p0 (1 - L h / T0)^k + b + n         measures: pressure
///              k = 5.255880,  L / T0 = 2.255770e-5 1/m,   n ~ N(0, sigma^2)
///   Jacobian   automatic differentiation               1 x (H + 1)
///   noise      R = sigma^2                             1x1, m^2 or Pa^2
///
///   symbol     shape  unit    frame  meaning
///   z          1      m, Pa   -      height, or pressure of the standard atmosphere
///   h          1      m       world  height of the body, the z element of a position
///   p0         1      Pa      -      pressure at h = 0; default: 101325
///   b          1      m, Pa   -      bias: a model parameter state, default: constant at 0
///   sigma      1      m, Pa   -      standard deviation of z; > 0
///
/// Defined for  a pressure: h < T0 / L = 44331 m. Otherwise out_of_domain; outputs unchanged.
/// Source       [Icao1993], troposphere: T0 = 288.15 K, L = 6.5 K/km, k = g M / (R L).
template <int H, bool kPressure>
struct Altitude : Sensor<Vec<1>, Vec<H>, Vec<1>> {
  static constexpr const char* kUnit = kPressure ? "Pa" : "m";
  static constexpr double kExponent = 5.255880, kLapse_1_m = 2.255770e-5;
  static constexpr std::array kRoles{
      H == 1 ? Quantity{"height", "m", "height of the body"}
             : Quantity{"position", "m", "position of the body, z upwards", kAxes<H>},
      Quantity{"bias", kUnit, "bias of the sensor", "", ALIDADE_ROLE_OWNED}};
  static constexpr Quantity kMeasurement{kPressure ? "pressure" : "height", kUnit,
                                         kPressure ? "pressure of the air" : "height of the body"};

  double sigma, reference_pressure_pa;

  explicit Altitude(double deviation, double reference_pa = 101325.0)
      : sigma(deviation), reference_pressure_pa(reference_pa) {}
  explicit Altitude(Params& p)
      : Altitude{p.Positive(kPressure ? "sigma_pa" : "sigma_m", kUnit,
                            "standard deviation of the measurement"),
                 kPressure ? p.Positive("reference_pressure_pa", "Pa", "pressure at the height 0",
                                        101325.0)
                           : 101325.0} {}

  template <class T>
  bool Predict(const T* place, const T* bias, T* z) const {
    using std::pow;
    const T& height = place[H - 1];
    if constexpr (kPressure) {
      const T temperature = 1.0 - kLapse_1_m * height;
      if (!(temperature > T(0.0))) return false;
      z[0] = reference_pressure_pa * pow(temperature, kExponent) + bias[0];
    } else {
      z[0] = height + bias[0];
    }
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, T* L) const {
    L[0] = T(sigma);
  }
};

}  // namespace alidade
