// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>

#include "alidade/model/model.h"

/// Models of a single block with any geometry G. For tests.
namespace alidade::testing {

/// Random walk x' = x (+) w, w ~ N(0, kSigma^2 dt I), with kSigma in tangent units / sqrt(s).
template <class G, double kSigma>
struct ManifoldWalk : Motion<G::kTangent, G> {
  static constexpr std::array kBlocks{Quantity{"x"}};
  template <class T>
  void Step(const T* x, const T* w, double, T* next) const {
    G::Plus(x, w, next);
  }
  void SqrtQ(double dt_s, MatrixRef l) const {
    for (int i = 0; i < G::kTangent; ++i) l(i, i) = kSigma * std::sqrt(dt_s);
  }
};

/// Sensor z = x (+) n, n ~ N(0, kSigma^2 I).
template <class G, double kSigma>
struct ManifoldSensor : Sensor<G, G> {
  static constexpr std::array kRoles{Quantity{"x"}};
  static constexpr Quantity kMeasurement{"z"};
  template <class T>
  bool Predict(const T* x, T* z) const {
    std::copy_n(x, G::kAmbient, z);
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, T* l) const {
    for (int i = 0; i < G::kTangent; ++i) l[(G::kTangent + 1) * i] = T(kSigma);
  }
};

}  // namespace alidade::testing
