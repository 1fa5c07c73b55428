// SPDX-License-Identifier: Apache-2.0
#include "alidade/model/plugin.h"

/// Measures the time from a pulse to its echo. The emitter and the microphone are at different
/// places.
///
///   model      t = 2 sqrt(Z^2 + (b/2)^2) / c + n,   n ~ N(0, sigma^2)
///   Jacobian   automatic differentiation               1x1, s/m
///   noise      R = sigma^2                             1x1, s^2
///
///   symbol     shape  unit    frame  meaning
///   t          1      s       -      time of flight
///   Z          1      m       body   distance of the target; > 0
///   b          1      m       -      distance from the emitter to the microphone; >= 0
///   c          1      m/s     -      speed of sound; > 0
///   sigma      1      s       -      standard deviation of t; > 0
///
/// Defined for  Z > 0; else out_of_domain, outputs untouched.
struct EchoTime : alidade::Sensor<alidade::Vec<1>, alidade::Vec<1>> {
  static constexpr std::array kRoles{alidade::Quantity{"distance", "m", "distance of the target"}};
  static constexpr alidade::Quantity kMeasurement{"echo", "s", "time from pulse to echo"};

  double half_baseline_m, speed_m_s, sigma_s;

  explicit EchoTime(alidade::Params& p)
      : half_baseline_m(0.5 * p.NonNegative("baseline_m", "m", "from emitter to microphone", 0.0)),
        speed_m_s(p.Positive("speed_m_s", "m/s", "speed of sound", 343.0)),
        sigma_s(p.Positive("sigma_s", "s", "noise of the time, 1 sigma")) {}

  template <class T>
  bool Predict(const T* distance, T* echo) const {
    if (!(distance[0] > T(0.0))) return false;
    using std::sqrt;
    echo[0] = 2.0 / speed_m_s * sqrt(distance[0] * distance[0] + half_baseline_m * half_baseline_m);
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, T* l) const {
    l[0] = T(sigma_s);
  }
};

ALIDADE_PLUGIN(ALIDADE_SENSOR(EchoTime, "echo_time",
                              "time of an echo: t = 2 sqrt(Z^2 + (b/2)^2) / c", ""))
