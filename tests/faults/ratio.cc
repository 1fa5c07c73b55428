// SPDX-License-Identifier: Apache-2.0
#include "alidade/plugin.h"

namespace {

/// Two blocks that can each be started from the other: the makings of a cycle.
struct Ratio : alidade::Sensor<alidade::Vec<1>, alidade::Vec<1>, alidade::Vec<1>> {
  static constexpr std::array kRoles{alidade::Quantity{"numerator"},
                                     alidade::Quantity{"denominator"}};
  static constexpr alidade::Quantity kMeasurement{"ratio"};
  static constexpr int kInitialises = 0;
  explicit Ratio(alidade::Params&) {}
  template <class T>
  bool Predict(const T* a, const T* b, T* z) const {
    z[0] = a[0] / b[0];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, T* l) const {
    l[0] = T(1.0);
  }
  template <class T>
  bool Initialise(const T* b, const T* z, T* a) const {
    a[0] = b[0] * z[0];
    return true;
  }
};

}  // namespace

ALIDADE_PLUGIN(ALIDADE_SENSOR(Ratio, "ratio", "a / b", ""))
