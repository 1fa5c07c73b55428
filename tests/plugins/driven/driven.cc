// SPDX-License-Identifier: Apache-2.0
#include "support/driven.h"

#include "alidade/model/plugin.h"

namespace {

/// Sensor z = x + n, n ~ N(0, sigma^2).
struct Fix : alidade::Sensor<alidade::Vec<1>, alidade::Vec<1>> {
  static constexpr std::array kRoles{alidade::Quantity{"position"}};
  static constexpr alidade::Quantity kMeasurement{"fix", "m"};
  double sigma_m;
  explicit Fix(alidade::Params& p)
      : sigma_m(p.Positive("sigma_m", "m", "noise of a fix, 1 sigma")) {}
  template <class T>
  bool Predict(const T* position, T* fix) const {
    fix[0] = position[0];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, T* l) const {
    l[0] = T(sigma_m);
  }
};

}  // namespace

ALIDADE_PLUGIN(ALIDADE_MOTION(alidade::testing::Driven, "driven", "position with a given speed",
                              ""),
               ALIDADE_SENSOR(Fix, "fix", "measured position", ""))
