// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include "alidade/state/covariance.h"

/// The arithmetic of a filter of few states, with loops over the n states of constant length; what
/// has no such loop serves filters of any size. P is column-major with leading dimension `ld`, its
/// lower triangle authoritative; H is m x n dense row-major; P H' and K are n x m column-major; S
/// (leading dimension `lds`), F and Q are row-major.
namespace alidade::internal {

inline constexpr int kSmall = 16;
/// Few states, at least one.
inline bool IsSmall(const Covariance& p) { return p.size() > 0 && p.size() <= kSmall; }
/// Of a variance, less than this left of it has lost nearly all its digits.
inline constexpr double kCancelled = 1e-10;

/// r' S^-1 r by S = L D L', m x m; not a number where S is not positive definite. Writes over the
/// m (m + 1) numbers of `work`.
[[gnu::always_inline]] inline double SquaredMahalanobis(const double* s, const double* r, int m,
                                                        double* work) {
  if (m == 1) return s[0] > 0.0 ? r[0] * r[0] / s[0] : std::nan("");
  double* const y = work + m * m;  // L^-1 r; D lies on the diagonal of L
  double sum = 0.0;
  for (int i = 0; i < m; ++i) {
    double* const l = work + i * m;
    double d = s[i * m + i];
    y[i] = r[i];
    for (int j = 0; j < i; ++j) {
      double v = s[i * m + j];
      for (int k = 0; k < j; ++k) v -= l[k] * work[k * m + k] * work[j * m + k];
      l[j] = v / work[j * m + j];
      d -= v * l[j];
      y[i] -= l[j] * y[j];
    }
    if (!(d > 0.0)) return std::nan("");
    l[i] = d;
    sum += y[i] * y[i] / d;
  }
  return sum;
}

/// gl = G L, n x w, and the lower triangle of q = G L L' G', n x n, for G n x w and L w x w.
[[gnu::always_inline]] inline void SpreadNoise(const double* g, const double* l, int n, int w,
                                               double* gl, double* q) {
  for (int i = 0; i < n; ++i) {
    for (int c = 0; c < w; ++c) {
      double sum = g[i * w] * l[c];
      for (int k = 1; k < w; ++k) sum += g[i * w + k] * l[k * w + c];
      gl[i * w + c] = sum;
    }
    for (int j = 0; j <= i; ++j) {
      double sum = -0.0;  // adds nothing, not even a sign
      for (int c = 0; c < w; ++c) sum += gl[i * w + c] * gl[j * w + c];
      q[i * n + j] = sum;
    }
  }
}

#define ALIDADE_UNROLL _Pragma("GCC unroll 8")

/// pht = P H', s = H P H' + s, for m rows.
template <int N>
[[gnu::always_inline]] inline void Project(const double* p, int ld, const double* h, int m,
                                           double* pht, double* s) {
  for (int c = 0; c < m; ++c) {
    const double* row = h + c * N;
    double* out = pht + c * N;
    ALIDADE_UNROLL for (int i = 0; i < N; ++i) {
      double sum = row[0] * p[i];
      ALIDADE_UNROLL for (int k = 1; k < N; ++k) sum +=
          row[k] * (i >= k ? p[k * ld + i] : p[i * ld + k]);
      out[i] = sum;
    }
    for (int r = 0; r < m; ++r) {
      if (r > c) continue;
      double sum = s[r * m + c];
      ALIDADE_UNROLL for (int k = 0; k < N; ++k) sum += h[r * N + k] * out[k];
      s[r * m + c] = s[c * m + r] = sum;
    }
  }
}

/// P both triangles, from and to the lower one.
template <int N>
[[gnu::always_inline]] inline void Load(const double* p, int ld, double (&whole)[N][N]) {
  ALIDADE_UNROLL for (int c = 0; c < N; ++c) {
    ALIDADE_UNROLL for (int r = c; r < N; ++r) whole[r][c] = whole[c][r] = p[c * ld + r];
  }
}
template <int N>
[[gnu::always_inline]] inline void Store(const double (&whole)[N][N], double* p, int ld) {
  ALIDADE_UNROLL for (int c = 0; c < N; ++c) {
    ALIDADE_UNROLL for (int r = c; r < N; ++r) p[c * ld + r] = whole[r][c];
  }
}

/// x' = F x of the k states from `o` on: P_aa <- F P_aa F' + Q, P_ai <- F P_ai; of Q the lower
/// triangle counts. K: k, or 0 where it is known at run time only.
template <int N, int K>
[[gnu::always_inline]] inline void Propagate(double (&p)[N][N], int o, int size, const double* f,
                                             const double* q) {
  const int k = K > 0 ? K : size;
  double fp[N][N];
  ALIDADE_UNROLL for (int r = 0; r < k; ++r) {
    ALIDADE_UNROLL for (int c = 0; c < N; ++c) {
      double sum = f[r * k] * p[o][c];
      ALIDADE_UNROLL for (int j = 1; j < k; ++j) sum += f[r * k + j] * p[o + j][c];
      fp[r][c] = sum;
    }
  }
  ALIDADE_UNROLL for (int r = 0; r < k; ++r) {
    ALIDADE_UNROLL for (int c = 0; c < N; ++c) p[o + r][c] = p[c][o + r] = fp[r][c];
  }
  ALIDADE_UNROLL for (int r = 0; r < k; ++r) {
    ALIDADE_UNROLL for (int c = 0; c <= r; ++c) {
      double sum = q[r * k + c];
      ALIDADE_UNROLL for (int j = 0; j < k; ++j) sum += fp[r][o + j] * f[c * k + j];
      p[o + r][o + c] = p[o + c][o + r] = sum;
    }
  }
}

/// S = L D L' of m rows, W = P H' L^-T (n x m, column-major), 1/D, dx = W D^-1 L^-1 r, and the gain
/// K = P H' S^-1; false where S is not positive definite. M: m, or 0 where it is known at run time
/// only.
template <int N, int M>
[[gnu::always_inline]] inline bool Solve(int rows, const double* pht, const double* s, int lds,
                                         const double* r, double* w, double* inverse_d, double* dx,
                                         double* gain) {
  constexpr int kMost = M > 0 ? M : kSmall;
  const int m = M > 0 ? M : rows;
  double l[kMost][kMost], scaled_l[kMost][kMost], y[kMost];  // L, L D, L^-1 r
  ALIDADE_UNROLL for (int i = 0; i < m; ++i) {
    double d = s[i * lds + i];
    y[i] = r[i];
    ALIDADE_UNROLL for (int j = 0; j < i; ++j) {
      double v = s[i * lds + j];
      ALIDADE_UNROLL for (int k = 0; k < j; ++k) v -= scaled_l[i][k] * l[j][k];
      scaled_l[i][j] = v;
      l[i][j] = v * inverse_d[j];
      d -= v * l[i][j];
      y[i] -= l[i][j] * y[j];
    }
    if (!(d > 0.0)) return false;
    inverse_d[i] = 1.0 / d;
    ALIDADE_UNROLL for (int n = 0; n < N; ++n) {
      double v = pht[i * N + n];
      ALIDADE_UNROLL for (int j = 0; j < i; ++j) v -= l[i][j] * w[j * N + n];
      w[i * N + n] = v;
    }
  }
  ALIDADE_UNROLL for (int n = 0; n < N; ++n) {
    double step = -0.0;  // so that nothing is added where the loop is unrolled
    ALIDADE_UNROLL for (int i = 0; i < m; ++i) step += w[i * N + n] * (inverse_d[i] * y[i]);
    dx[n] = step;
  }
  ALIDADE_UNROLL for (int i = m - 1; i >= 0; --i) {
    ALIDADE_UNROLL for (int n = 0; n < N; ++n) {
      double v = w[i * N + n] * inverse_d[i];
      ALIDADE_UNROLL for (int j = i + 1; j < m; ++j) v -= gain[j * N + n] * l[j][i];
      gain[i * N + n] = v;
    }
  }
  return true;
}

/// The lower triangle of P - W D^-1 W' (n x n, leading dimension n) to `updated`; false where a
/// variance would lose nearly all its digits.
template <int N, int M>
[[gnu::always_inline]] inline bool Downdate(const double* p, int ld, int rows, const double* w,
                                            const double* inverse_d, double* updated) {
  const int m = M > 0 ? M : rows;
  bool kept = true;
  ALIDADE_UNROLL for (int c = 0; c < N; ++c) {
    double scaled[M > 0 ? M : kSmall];
    ALIDADE_UNROLL for (int i = 0; i < m; ++i) scaled[i] = w[i * N + c] * inverse_d[i];
    ALIDADE_UNROLL for (int r = c; r < N; ++r) {
      double v = p[c * ld + r];
      ALIDADE_UNROLL for (int i = 0; i < m; ++i) v -= w[i * N + r] * scaled[i];
      updated[c * N + r] = v;
    }
    kept &= !(updated[c * N + c] < kCancelled * p[c * ld + c]);
  }
  return kept;
}

/// The lower triangle of what Downdate gave, to P. Unrolled, so that it never lies in memory
/// between the two: pairs read there would wait for the single numbers that were written.
template <int N>
[[gnu::always_inline]] inline void StoreLower(const double* updated, double* p, int ld) {
  ALIDADE_UNROLL for (int c = 0; c < N; ++c) {
    ALIDADE_UNROLL for (int r = c; r < N; ++r) p[c * ld + r] = updated[c * N + r];
  }
}

#undef ALIDADE_UNROLL

/// The same for n states, 1 to kSmall, known at run time.
struct SmallKernels {
  decltype(&Project<1>) project;
  void (*propagate)(double* p, int ld, int o, int k, const double* f, const double* q);
  decltype(&Solve<1, 0>) solve;
  bool (*downdate)(double* p, int ld, int m, const double* w, const double* inverse_d);
};
const SmallKernels& SmallKernelsFor(int n);

}  // namespace alidade::internal
