// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/model/model.h"

namespace alidade {

/// Measured value of a block, in any geometry: a position, an angle, a speed, an orientation.
///
///   model      z = x (+) b (+) n,   n ~ N(0, R)
///   Jacobian   automatic differentiation               n x n, n x n
///   noise      R = diag(sigma^2), or the covariance of the measurement    n x n
///   inverse    x = z (+) -b; of a unit vector only for b = 0
///
///   symbol     shape  unit    frame  meaning
///   x          G      any     any    the block
///   b          n      unit of x  -   bias: a model parameter state, by default constant at 0
///   sigma      1      unit of x  -   standard deviation for each tangent element; > 0
///   G          -      -       -      vector of 1 to 9 elements, angle, unit quaternion or unit
///                                    vector; n is its number of tangent elements
///
/// Defined everywhere.
/// Source       (+) of each geometry: docs/conventions.md, [Sola2017] ch. 4.
template <class G>
struct Direct : Sensor<G, G, Vec<G::kTangent>> {
  static constexpr int kSize = G::kTangent;
  static constexpr std::array kRoles{
      Quantity{"value", "", "block that is measured"},
      Quantity{"bias", "", "bias of the sensor", "", ALIDADE_ROLE_OWNED}};
  static constexpr Quantity kMeasurement{"value", "", "measured value of the block"};
  static constexpr int kInitialises = 0;

  std::array<double, kSize> sigma;

  explicit Direct(const std::array<double, kSize>& deviations) : sigma(deviations) {}
  explicit Direct(Params& p)
      : Direct(p.PerAxis<kSize>("sigma", "unit", "standard deviation of the measured value",
                                kPositive)) {}

  template <class T>
  bool Predict(const T* x, const T* bias, T* z) const {
    G::Plus(x, bias, z);
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, T* L) const {
    for (int i = 0; i < kSize; ++i) L[(kSize + 1) * i] = T(sigma[static_cast<std::size_t>(i)]);
  }
  template <class T>
  bool Initialise(const T* bias, const T* z, T* x) const {
    T minus[kSize];
    for (int i = 0; i < kSize; ++i) {
      if (kHasTransport<G> && bias[i] != T(0.0)) return false;
      minus[i] = -bias[i];
    }
    G::Plus(z, minus, x);
    return true;
  }
};

}  // namespace alidade
