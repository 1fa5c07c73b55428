// SPDX-License-Identifier: Apache-2.0
#include "small_kernels.h"

#include <array>
#include <utility>

namespace alidade::internal {
namespace {

#define ALIDADE_UNROLL _Pragma("GCC unroll 8")

template <int N>
void Project(const double* p, int ld, const double* h, int m, double* pht, double* s) {
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

template <int N>
void Propagate(double* p, int ld, int o, int k, const double* f, const double* q) {
  double fp[N][N];
  for (int r = 0; r < k; ++r) {
    ALIDADE_UNROLL for (int c = 0; c < N; ++c) {
      double sum = -0.0;
      for (int j = 0; j < k; ++j)
        sum += f[r * k + j] * (o + j >= c ? p[c * ld + o + j] : p[(o + j) * ld + c]);
      fp[r][c] = sum;
    }
  }
  for (int r = 0; r < k; ++r) {
    for (int c = 0; c < o; ++c) p[c * ld + o + r] = fp[r][c];
    for (int c = o + k; c < N; ++c) p[(o + r) * ld + c] = fp[r][c];
    for (int c = 0; c <= r; ++c) {
      double sum = q[r * k + c];
      for (int j = 0; j < k; ++j) sum += fp[r][o + j] * f[c * k + j];
      p[(o + c) * ld + o + r] = sum;
    }
  }
}

/// M: number of rows, or 0 where it is known at run time only.
template <int N, int M>
Covariance::Solved SolveRows(const double* p, int ld, int rows, const double* pht, const double* s,
                             const double* r, double* w, double* inverse_d, double* dx,
                             double* gain) {
  constexpr int kMost = M > 0 ? M : kSmall;
  const int m = M > 0 ? M : rows;
  double l[kMost][kMost], scaled_l[kMost][kMost], y[kMost];  // L, L D, L^-1 r
  ALIDADE_UNROLL for (int i = 0; i < m; ++i) {
    double d = s[i * m + i];
    y[i] = r[i];
    ALIDADE_UNROLL for (int j = 0; j < i; ++j) {
      double v = s[i * m + j];
      ALIDADE_UNROLL for (int k = 0; k < j; ++k) v -= scaled_l[i][k] * l[j][k];
      scaled_l[i][j] = v;
      l[i][j] = v * inverse_d[j];
      d -= v * l[i][j];
      y[i] -= l[i][j] * y[j];
    }
    if (!(d > 0.0)) return Covariance::Solved::kNotPd;
    inverse_d[i] = 1.0 / d;
    ALIDADE_UNROLL for (int n = 0; n < N; ++n) {
      double v = pht[i * N + n];
      ALIDADE_UNROLL for (int j = 0; j < i; ++j) v -= l[i][j] * w[j * N + n];
      w[i * N + n] = v;
    }
  }
  constexpr double kCancelled = 1e-10;
  bool cancelled = false;
  ALIDADE_UNROLL for (int n = 0; n < N; ++n) {
    double step = -0.0, lost = -0.0;
    ALIDADE_UNROLL for (int i = 0; i < m; ++i) {
      const double scaled = w[i * N + n] * inverse_d[i];
      step += scaled * y[i];
      lost += scaled * w[i * N + n];
    }
    dx[n] = step;
    const double variance = p[n * ld + n];
    cancelled |= variance - lost < kCancelled * variance;
  }
  ALIDADE_UNROLL for (int i = m - 1; i >= 0; --i) {
    ALIDADE_UNROLL for (int n = 0; n < N; ++n) {
      double v = w[i * N + n] * inverse_d[i];
      ALIDADE_UNROLL for (int j = i + 1; j < m; ++j) v -= gain[j * N + n] * l[j][i];
      gain[i * N + n] = v;
    }
  }
  return cancelled ? Covariance::Solved::kCancelled : Covariance::Solved::kYes;
}

template <int N>
Covariance::Solved Solve(const double* p, int ld, int m, const double* pht, const double* s,
                         const double* r, double* w, double* inverse_d, double* dx, double* gain) {
  switch (m) {
    case 1:
      return SolveRows<N, 1>(p, ld, m, pht, s, r, w, inverse_d, dx, gain);
    case 2:
      return SolveRows<N, 2>(p, ld, m, pht, s, r, w, inverse_d, dx, gain);
    default:
      return SolveRows<N, 0>(p, ld, m, pht, s, r, w, inverse_d, dx, gain);
  }
}

template <int N>
void Downdate(double* p, int ld, int m, const double* w, const double* inverse_d) {
  for (int i = 0; i < m; ++i) {
    const double* column = w + i * N;
    ALIDADE_UNROLL for (int c = 0; c < N; ++c) {
      const double scaled = column[c] * inverse_d[i];
      ALIDADE_UNROLL for (int r = c; r < N; ++r) p[c * ld + r] -= column[r] * scaled;
    }
  }
}

template <std::size_t... I>
constexpr std::array<SmallKernels, kSmall> Table(std::index_sequence<I...>) {
  return {SmallKernels{Project<static_cast<int>(I) + 1>, Propagate<static_cast<int>(I) + 1>,
                       Solve<static_cast<int>(I) + 1>, Downdate<static_cast<int>(I) + 1>}...};
}

constexpr std::array<SmallKernels, kSmall> kKernels = Table(std::make_index_sequence<kSmall>{});

}  // namespace

const SmallKernels& SmallKernelsFor(int n) { return kKernels[static_cast<std::size_t>(n - 1)]; }

}  // namespace alidade::internal
