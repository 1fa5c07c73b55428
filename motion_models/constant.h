// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/model/model.h"

namespace alidade {

/// Constant value, or a random walk.
///
///   model      x' = x + w,   w ~ N(0, q^2 dt I)        q = 0: constant, w has size 0
///   Jacobian   F = I, G = I                            n x n
///
///   symbol     shape  unit        meaning
///   x          n      any         the value
///   q          1      unit/s^0.5  standard deviation of the change in one second; >= 0
///   n          -      -           number of elements; >= 1
///
/// Defined everywhere.
/// Source       [Ekf2017] sec. 1.2 (lambda); random walk [BarShalom2001] sec. 6.2.
template <int N = kDynamic>
struct Constant : Motion<N, Vec<N>> {
  static constexpr std::array kBlocks{Quantity{"value", "", "the value"}};

  int size;  ///< number of elements, if N is kDynamic
  double walk;

  explicit Constant(int n, double random_walk = 0.0) : size(n), walk(random_walk) {}
  explicit Constant(Params& p)
      : Constant(
            p.Integer("size", "number of elements", 1, 1 << 20, 1),
            p.NonNegative("noise.random_walk", "unit/s^0.5",
                          "standard deviation of the change in one second; 0: constant", 0.0)) {}

  int Size(int) const { return N == kDynamic ? size : N; }
  bool Stationary() const { return !(walk > 0.0); }
  int NoiseSize() const { return walk > 0.0 ? Size(0) : 0; }

  template <class T>
  void Step(const T* x, const T* w, double, T* next) const {
    for (int i = 0; i < Size(0); ++i) next[i] = walk > 0.0 ? T(x[i] + w[i]) : x[i];
  }
  void StepJacobian(const double*, const double*, double, MatrixRef f, MatrixRef g) const {
    for (int i = 0; i < Size(0); ++i) f(i, i) = 1.0;
    for (int i = 0; i < NoiseSize(); ++i) g(i, i) = 1.0;
  }
  void SqrtQ(double dt_s, MatrixRef l) const {
    for (int i = 0; i < NoiseSize(); ++i) l(i, i) = walk * std::sqrt(dt_s);
  }
};

}  // namespace alidade
