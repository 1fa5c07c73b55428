// SPDX-License-Identifier: Apache-2.0
#include "alidade/model/plugin.h"

/// A body whose temperature approaches that of its surroundings, by Newton's law of cooling.
///
///   model      T' = A + (T - A) exp(-dt / tau) + w
///   noise      w ~ N(0, q^2 tau / 2 (1 - exp(-2 dt / tau))), the exact integral of white noise
///              that drives dT/dt; Q does not depend on how dt is split
///   Jacobian   F = exp(-dt / tau)                      1x1, by automatic differentiation
///
///   symbol     shape  unit       meaning
///   T          1      degC       temperature of the body
///   A          1      degC       temperature of its surroundings
///   tau        1      s          time in which the difference falls to 37 %; > 0
///   q          1      degC/s^.5  density of the noise; >= 0
struct Cooling : alidade::Motion<1, alidade::Vec<1>> {
  static constexpr std::array kBlocks{alidade::Quantity{"temperature", "degC", "of the body"}};

  double ambient, tau_s, density;

  explicit Cooling(alidade::Params& p)
      : ambient(p.Number("ambient_degc", "degC", "temperature of the surroundings")),
        tau_s(p.Positive("time_constant_s", "s", "time to fall to 37 %")),
        density(p.NonNegative("noise.density", "degC/s^0.5", "density of the driving noise")) {}

  template <class T>
  void Step(const T* temperature, const T* w, double dt_s, T* next) const {
    next[0] = ambient + std::exp(-dt_s / tau_s) * (temperature[0] - ambient) + w[0];
  }
  void SqrtQ(double dt_s, alidade::MatrixRef l) const {
    l(0, 0) = density * std::sqrt(-0.5 * tau_s * std::expm1(-2.0 * dt_s / tau_s));
  }
};

/// Measures the temperature: z = T + n, n ~ N(0, sigma^2), degC.
struct Thermometer : alidade::Sensor<alidade::Vec<1>, alidade::Vec<1>> {
  static constexpr std::array kRoles{alidade::Quantity{"temperature", "degC", "of the body"}};
  static constexpr alidade::Quantity kMeasurement{"reading", "degC", "of the thermometer"};

  double sigma;

  explicit Thermometer(alidade::Params& p)
      : sigma(p.Positive("sigma_degc", "degC", "noise of a reading, 1 sigma")) {}

  template <class T>
  bool Predict(const T* temperature, T* z) const {
    z[0] = temperature[0];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, T* l) const {
    l[0] = T(sigma);
  }
};

ALIDADE_PLUGIN(ALIDADE_MOTION(Cooling, "cooling", "Newton's law of cooling", ""),
               ALIDADE_SENSOR(Thermometer, "thermometer", "a temperature as it is", ""))
