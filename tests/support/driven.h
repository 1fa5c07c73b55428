// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include "alidade/model.h"

/// The smallest model with a control input, for tests.
namespace alidade::testing {

/// A position on a line, driven by its velocity.
///
///   model      x' = x + (u + w) dt,   w ~ N(0, sigma^2 / dt):  Var(x') = Var(x) + sigma^2 dt
///
///   symbol     shape  unit      meaning
///   x          1      m         position
///   u          1      m/s       velocity, the control input
///   sigma      1      m/s^0.5   noise of the velocity; >= 0
struct Driven : Motion<1, Vec<1>> {
  static constexpr std::array kBlocks{Quantity{"position", "m"}};
  using Input = Vec<1>;
  static constexpr Quantity kInput{"speed", "m/s"};
  double sigma;
  explicit Driven(double s) : sigma(s) {}
  explicit Driven(Params& p)
      : sigma(p.NonNegative("noise.speed", "m/s^0.5", "noise of the velocity")) {}
  template <class T>
  void Step(const T* x, const T* u, const T* w, double dt_s, T* next) const {
    next[0] = x[0] + (u[0] + w[0]) * dt_s;
  }
  void SqrtQ(double dt_s, MatrixRef l) const {
    l(0, 0) = dt_s > 0.0 ? sigma / std::sqrt(dt_s) : 0.0;
  }
};

}  // namespace alidade::testing
