// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/covariance.h"

/// The arithmetic of a filter of few states, with loops over the n states of constant length. P is
/// column-major with leading dimension `ld`, its lower triangle authoritative; H is m x n dense
/// row-major; P H' and K are n x m column-major; S, F and Q are row-major.
namespace alidade::internal {

inline constexpr int kSmall = Covariance::kSmall;

struct SmallKernels {
  /// pht = P H', s = H P H' + s, for m rows.
  void (*project)(const double* p, int ld, const double* h, int m, double* pht, double* s);
  /// x' = F x of the k states from `offset` on: P_aa <- F P_aa F' + Q, P_ai <- F P_ai.
  void (*propagate)(double* p, int ld, int offset, int k, const double* f, const double* q);
  /// S = L D L' of m rows, W = P H' L^-T (n x m, column-major), 1/D, dx = W D^-1 L^-1 r, and the
  /// gain K = P H' S^-1.
  Covariance::Solved (*solve)(const double* p, int ld, int m, const double* pht, const double* s,
                              const double* r, double* w, double* inverse_d, double* dx,
                              double* gain);
  /// P <- P - W D^-1 W'
  void (*downdate)(double* p, int ld, int m, const double* w, const double* inverse_d);
};

/// For n states, 1 to kSmall.
const SmallKernels& SmallKernelsFor(int n);

}  // namespace alidade::internal
