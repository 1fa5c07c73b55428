// SPDX-License-Identifier: Apache-2.0
#include "alidade/model/plugin.h"

/// Range rate of a point, measured by a Doppler radar at the origin. This file is a complete sensor
/// as a third party would write it.
///
///   model      z = p . v / |p| + n,   n ~ N(0, sigma^2)
///
/// Defined for  |p| > 0; else out_of_domain, and the outputs are not changed.
struct RangeRate : alidade::Sensor<alidade::Vec<1>, alidade::Vec<2>, alidade::Vec<2>> {
  static constexpr std::array kRoles{alidade::Quantity{"position", "m", "of the point", "x,y"},
                                     alidade::Quantity{"velocity", "m/s", "of the point", "x,y"}};
  static constexpr alidade::Quantity kMeasurement{"range_rate", "m/s", "closing is negative"};
  double sigma;
  explicit RangeRate(alidade::Params& p)
      : sigma(p.Positive("sigma_m_s", "m/s", "noise, 1 sigma")) {}
  template <class T>
  bool Predict(const T* p, const T* v, T* z) const {
    using std::sqrt;
    const T range = sqrt(p[0] * p[0] + p[1] * p[1]);
    if (!(range > T(0.0))) return false;
    z[0] = (p[0] * v[0] + p[1] * v[1]) / range;
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, T* l) const {
    l[0] = T(sigma);
  }
};

ALIDADE_PLUGIN(ALIDADE_SENSOR(RangeRate, "range_rate", "Doppler radar", ""))
