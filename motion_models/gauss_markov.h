// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/model/model.h"

namespace alidade {

/// First-order Gauss-Markov process: a value that returns to 0, such as a slowly varying bias.
///
///   model      x' = a x + w,   a = e^(-dt/tau)
///   noise      w ~ N(0, sigma^2 (1 - a^2) I): the exact integral of white noise. sigma is the
///              standard deviation of x after a long time
///   Jacobian   F = a I, G = I                          n x n
///
///   symbol     shape  unit  meaning
///   x          n      any   the value
///   tau        1      s     time constant; > 0
///   sigma      1      unit  stationary standard deviation of x; >= 0
///   n          -      -     number of elements; >= 1
///
/// Defined everywhere.
/// Source       [BarShalom2001] sec. 8.2.
template <int N = kDynamic>
struct GaussMarkov : Motion<N, Vec<N>> {
  static constexpr std::array kBlocks{Quantity{"value", "", "the value"}};

  int size;  ///< number of elements, if N is kDynamic
  double tau_s, sigma;

  GaussMarkov(int n, double time_constant_s, double stationary_sigma)
      : size(n), tau_s(time_constant_s), sigma(stationary_sigma) {}
  explicit GaussMarkov(Params& p)
      : GaussMarkov(p.Integer("size", "number of elements", 1, 1 << 20, 1),
                    p.Positive("time_constant_s", "s",
                               "time in which the correlation of the value falls to 1/e"),
                    p.NonNegative("noise.sigma", "unit",
                                  "standard deviation of the value after a long time")) {}

  int Size(int) const { return N == kDynamic ? size : N; }
  int NoiseSize() const { return Size(0); }

  template <class T>
  void Step(const T* x, const T* w, double dt_s, T* next) const {
    const double a = std::exp(-dt_s / tau_s);
    for (int i = 0; i < Size(0); ++i) next[i] = a * x[i] + w[i];
  }
  void StepJacobian(const double*, const double*, double dt_s, MatrixRef f, MatrixRef g) const {
    for (int i = 0; i < Size(0); ++i) {
      f(i, i) = std::exp(-dt_s / tau_s);
      g(i, i) = 1.0;
    }
  }
  void SqrtQ(double dt_s, MatrixRef l) const {
    const double root = std::sqrt(-std::expm1(-2.0 * dt_s / tau_s));
    for (int i = 0; i < Size(0); ++i) l(i, i) = sigma * root;
  }
};

}  // namespace alidade
