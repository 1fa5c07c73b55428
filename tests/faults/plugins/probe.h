// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/model/model.h"

/// The sensor z = PROBE_GAIN x, from which the deliberately faulty plugins are derived.
#ifndef PROBE_GAIN
#define PROBE_GAIN 2.0
#endif

struct Probe : alidade::Sensor<alidade::Vec<1>, alidade::Vec<1>> {
  static constexpr std::array kRoles{alidade::Quantity{"x", "m"}};
  static constexpr alidade::Quantity kMeasurement{"z", "m"};
  explicit Probe(alidade::Params&) {}
  template <class T>
  bool Predict(const T* x, T* z) const {
    z[0] = PROBE_GAIN * x[0];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, T* l) const {
    l[0] = T(1.0);
  }
};
