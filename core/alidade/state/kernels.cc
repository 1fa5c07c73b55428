// SPDX-License-Identifier: Apache-2.0
#include "alidade/state/kernels.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <utility>

#include "alidade/base/all_finite.h"

#pragma GCC diagnostic ignored "-Wpsabi"  // vectors are inlined, never passed

#define ALIDADE_KERNEL [[gnu::always_inline]] static inline
#define ALIDADE_UNROLL _Pragma("GCC unroll 8")

namespace alidade::internal {
namespace {

constexpr int kSmall = 8;

/// Of a variance, less than this left of it has lost nearly all its digits.
constexpr double kCancelled = 1e-10;

/// Finite too.
inline bool IsPositive(double x) { return x > 0.0 && x < std::numeric_limits<double>::infinity(); }

/// All N states of a small filter, number by number: what has just been written is not read as a
/// vector, which would wait for the store.
template <int N>
struct Scalars {
  static constexpr int kRows = N, kStates = N;
  double v[N];

  void Load(const double* from) { ALIDADE_UNROLL for (int i = 0; i < N; ++i) v[i] = from[i]; }
  void Store(double* to) const { ALIDADE_UNROLL for (int i = 0; i < N; ++i) to[i] = v[i]; }
  void Add(double k, const Scalars& x) {
    ALIDADE_UNROLL for (int i = 0; i < N; ++i) v[i] += k * x.v[i];
  }
  void Subtract(double k, const Scalars& x) {
    ALIDADE_UNROLL for (int i = 0; i < N; ++i) v[i] -= k * x.v[i];
  }
  void AddSquares(double k, const Scalars& x) {
    ALIDADE_UNROLL for (int i = 0; i < N; ++i) v[i] += k * x.v[i] * x.v[i];
  }
};

/// N of many states, in one vector register.
template <int N>
struct Vector {
  static constexpr int kRows = N, kStates = 0;
  using Register [[gnu::vector_size(N * sizeof(double))]] = double;
  Register v;

  [[gnu::always_inline]] void Load(const double* from) { std::memcpy(&v, from, sizeof v); }
  [[gnu::always_inline]] void Store(double* to) const { std::memcpy(to, &v, sizeof v); }
  [[gnu::always_inline]] void Add(double k, const Vector& x) { v += k * x.v; }
  [[gnu::always_inline]] void Subtract(double k, const Vector& x) { v -= k * x.v; }
  [[gnu::always_inline]] void AddSquares(double k, const Vector& x) { v += k * x.v * x.v; }
};

/// The kernels on panels of Column::kRows rows, for updates of M rows (0: any number).
template <class Column, int M>
struct Arithmetic {
  static constexpr int kRows = Column::kRows, kStates = Column::kStates;
  /// How many panels a tile of the downdate is high: enough sums to keep the pipes full.
  static constexpr int kHigh = kStates > 0 ? 1 : 2;

  // What the compiler knows of a small state or update.
  ALIDADE_KERNEL SymmetricView Sized(const SymmetricView& p) {
    return kStates > 0 ? SymmetricView{p.data, kStates, kSmall} : p;
  }
  ALIDADE_KERNEL int Rows(int m) { return M > 0 ? M : m; }
  /// Element (i, j) of a matrix in panels.
  ALIDADE_KERNEL double& At(const Update& u, double* panels, int i, int j) {
    if (kStates > 0) return panels[j * kRows + i];
    const int row = i % kRows;
    return panels[std::ptrdiff_t{i - row} * u.capacity + std::ptrdiff_t{j} * kRows + row];
  }

  /// y += k x, n numbers.
  ALIDADE_KERNEL void AddScaled(int n, double k, const double* x, double* y) {
    int i = 0;
    for (; kStates == 0 && i + kRows <= n; i += kRows) {
      Column sum, term;
      sum.Load(y + i);
      term.Load(x + i);
      sum.Add(k, term);
      sum.Store(y + i);
    }
    ALIDADE_UNROLL for (; i < n; ++i) y[i] += k * x[i];
  }
  /// S = L D L' in place, m x m by columns; false unless positive definite. Reads the lower
  /// triangle.
  ALIDADE_KERNEL bool Factorise(int m, double* s, double* inverse_d) {
    const int stride = PaddedSize(m);
    int at = 0;
    for (; kStates == 0 && at + kRows <= m; at += kRows) {  // rows [at, at + kRows) of L
      Divide(at, s, s + at, stride, stride);
      double* const own = s + std::ptrdiff_t{at} * stride + at;
      Column x[kRows];
      ALIDADE_UNROLL for (int c = 0; c < kRows; ++c) x[c].Load(own + c * stride);
      for (int k = 0; k < at; ++k) {
        double* const l = s + std::ptrdiff_t{k} * stride + at;
        Column before, scaled{};
        before.Load(l);
        scaled.Add(inverse_d[k], before);
        scaled.Store(l);
        ALIDADE_UNROLL for (int c = 0; c < kRows; ++c) x[c].Subtract(l[c], before);
      }
      ALIDADE_UNROLL for (int c = 0; c < kRows; ++c) x[c].Store(own + c * stride);
      if (!FactoriseOwn(kRows, own, stride, inverse_d + at)) return false;
    }
    for (int i = at; kStates == 0 && i < m; ++i) {  // the last rows, one by one
      for (int j = 0; j < i; ++j) {
        double sum = s[std::ptrdiff_t{j} * stride + i];
        for (int k = 0; k < j; ++k) {
          sum -= s[std::ptrdiff_t{k} * stride + i] * s[std::ptrdiff_t{k} * stride + j];
        }
        s[std::ptrdiff_t{j} * stride + i] = sum;
      }
      double* const pivot = s + std::ptrdiff_t{i} * (stride + 1);
      for (int k = 0; k < i; ++k) {
        double& l = s[std::ptrdiff_t{k} * stride + i];
        const double before = l;
        l *= inverse_d[k];
        *pivot -= l * before;
      }
      if (!IsPositive(*pivot)) return false;
      inverse_d[i] = 1.0 / *pivot;
    }
    return kStates == 0 || FactoriseOwn(m, s, stride, inverse_d);
  }
  /// The same of few rows, by columns.
  ALIDADE_KERNEL bool FactoriseOwn(int m, double* s, int stride, double* inverse_d) {
    ALIDADE_UNROLL for (int k = 0; k < m; ++k) {
      double* const l = s + std::ptrdiff_t{k} * stride;
      if (!IsPositive(l[k])) return false;
      inverse_d[k] = 1.0 / l[k];
      ALIDADE_UNROLL for (int j = k + 1; j < m; ++j) {  // to the right, while l is still L D
        const double factor = -l[j] * inverse_d[k];
        ALIDADE_UNROLL for (int i = j; i < m; ++i) s[std::ptrdiff_t{j} * stride + i] +=
            factor * l[i];
      }
      ALIDADE_UNROLL for (int i = k + 1; i < m; ++i) l[i] *= inverse_d[k];
    }
    return true;
  }
  /// y <- L^-1 y.
  ALIDADE_KERNEL void Substitute(int m, const double* l, double* y) {
    const int stride = PaddedSize(m);
    ALIDADE_UNROLL for (int k = 0; k + 1 < m; ++k) {
      AddScaled(m - k - 1, -y[k], l + std::ptrdiff_t{k} * stride + k + 1, y + k + 1);
    }
  }

  /// Rows [i, i + kRows) of column c of P.
  ALIDADE_KERNEL Column ColumnOf(const SymmetricView& p, int c, int i) {
    Column column;
    if (kStates == 0 && c <= i) {
      column.Load(p.data + std::ptrdiff_t{c} * p.stride + i);
    } else {
      double rows[kRows];
      const double* const from = p.data + std::ptrdiff_t{i} * p.stride + c;
      if (kStates == 0 && c >= i + kRows) {
        ALIDADE_UNROLL for (int r = 0; r < kRows; ++r) rows[r] = from[std::ptrdiff_t{r} * p.stride];
      } else {
        ALIDADE_UNROLL for (int r = 0; r < kRows; ++r) rows[r] = p(i + r, c);
      }
      column.Load(rows);
    }
    return column;
  }
  /// P H' of rows [first, last) of H, kAtOnce of them at a time, in the columns of w from `at` on.
  template <int kAtOnce>
  ALIDADE_KERNEL void ProjectRows(const Update& u, const JacobianRows& rows, int first, int last,
                                  int at) {
    const SymmetricView p = Sized(u.p);
    const int width = rows.width();
    const int* const columns = rows.columns.data();
    for (int i = 0; i < p.size; i += kRows) {
      double* const pht = &At(u, u.w, i, at);
      for (int r = first; r < last; r += kAtOnce) {
        Column sum[kAtOnce]{};
        for (int c = 0; c < width; ++c) {
          const Column column = ColumnOf(p, columns[c], i);
          ALIDADE_UNROLL for (int k = 0; k < kAtOnce; ++k) {
            sum[k].Add(rows.data[(r + k) * width + c], column);
          }
        }
        ALIDADE_UNROLL for (int k = 0; k < kAtOnce; ++k) sum[k].Store(pht + (r + k) * kRows);
      }
    }
  }
  ALIDADE_KERNEL void Project(const Update& u, const JacobianRows& rows, int m, int at) {
    if (M > 0) return ProjectRows<std::max(M, 1)>(u, rows, 0, m, at);
    constexpr int kAtOnce = kStates > 0 ? 1 : 3;  // most measurements of more than two have three
    const int most = m - m % kAtOnce;
    ProjectRows<kAtOnce>(u, rows, 0, most, at);
    if (kAtOnce > 1) ProjectRows<1>(u, rows, most, m, at);
  }
  ALIDADE_KERNEL double ComputeNis(const Update& u, const MeasurementRows& one) {
    const int m = Rows(one.h.rows), width = one.h.width();
    const double* const h = one.h.data;
    const int* const columns = one.h.columns.data();
    double* const s = one.s;
    Project(u, one.h, m, one.column);
    ALIDADE_UNROLL for (int i = 0; i < m; ++i) {
      ALIDADE_UNROLL for (int j = 0; j <= i; ++j) {
        double sum = one.noise[i * m + j];
        for (int c = 0; c < width; ++c) {
          sum += h[i * width + c] * At(u, u.w, columns[c], one.column + j);
        }
        s[i * m + j] = s[j * m + i] = sum;
      }
    }
    const double* const r = one.innovation;
    if (M == 1) return IsPositive(s[0]) ? r[0] * r[0] / s[0] : kNotANumber;
    const int stride = PaddedSize(m);
    ALIDADE_UNROLL for (int j = 0; j < m; ++j) {
      ALIDADE_UNROLL for (int i = j; i < m; ++i) u.s[j * stride + i] = s[i * m + j];
      u.y[j] = r[j];
    }
    if (!Factorise(m, u.s, u.inverse_d)) return kNotANumber;
    Substitute(m, u.s, u.y);
    double nis = 0.0;
    ALIDADE_UNROLL for (int i = 0; i < m; ++i) nis += u.y[i] * u.y[i] * u.inverse_d[i];
    return nis;
  }

  /// The lower triangle of S, and the innovations.
  ALIDADE_KERNEL void Stack(const Update& u, int m) {
    const int stride = PaddedSize(m);
    for (const MeasurementRows* const each : u.measurements) {
      const MeasurementRows& one = *each;
      const int at = one.column, rows = one.h.rows;
      if (at > 0) StackBefore(u, one, stride);
      for (int r = 0; r < rows; ++r) {
        for (int j = 0; j <= r; ++j) {
          u.s[std::ptrdiff_t{at + j} * stride + at + r] = one.s[r * rows + j];
        }
        u.y[at + r] = one.innovation[r];
      }
    }
  }
  /// H of a measurement times P H' of those before it, some columns of H at a time.
  ALIDADE_KERNEL void StackBefore(const Update& u, const MeasurementRows& one, int stride) {
    constexpr int kAtOnce = 16;
    const int at = one.column, rows = one.h.rows, width = one.h.width();
    const int* const columns = one.h.columns.data();
    for (int r = 0; kStates > 0 && r < rows; ++r) {
      const double* const h = one.h.data + r * width;
      for (int j = 0; j < at; ++j) {
        double sum = 0.0;
        for (int c = 0; c < width; ++c) sum += h[c] * At(u, u.w, columns[c], j);
        u.s[std::ptrdiff_t{j} * stride + at + r] = sum;
      }
    }
    for (int first = 0; kStates == 0 && first < width; first += kAtOnce) {
      const int count = std::min(kAtOnce, width - first);
      const double* from[kAtOnce];
      for (int c = 0; c < count; ++c) {
        from[c] = &At(u, u.w, columns[first + c], 0);
      }
      for (int r = 0; r < rows; ++r) {
        const double* const h = one.h.data + r * width + first;
        double* const s = u.s + at + r;
        for (int j = 0; j < at; ++j) {
          double sum = first == 0 ? 0.0 : s[std::ptrdiff_t{j} * stride];
          for (int c = 0; c < count; ++c) sum += h[c] * from[c][j * kRows];
          s[std::ptrdiff_t{j} * stride] = sum;
        }
      }
    }
  }
  /// Rows of P H' to those of W, kRows columns at a time; columns lie `step` apart.
  ALIDADE_KERNEL void Divide(int m, const double* l, double* panel, int step, int stride) {
    int j = 0;
    for (; kStates == 0 && j + kRows <= m; j += kRows) {
      Column x[kRows];
      ALIDADE_UNROLL for (int c = 0; c < kRows; ++c) x[c].Load(panel + (j + c) * step);
      for (int k = 0; k < j; ++k) {
        Column done;
        done.Load(panel + k * step);
        const double* const row = l + std::ptrdiff_t{k} * stride + j;
        ALIDADE_UNROLL for (int c = 0; c < kRows; ++c) x[c].Subtract(row[c], done);
      }
      ALIDADE_UNROLL for (int c = 0; c < kRows; ++c) {
        ALIDADE_UNROLL for (int k = 0; k < c; ++k) {
          x[c].Subtract(l[std::ptrdiff_t{j + k} * stride + j + c], x[k]);
        }
        x[c].Store(panel + (j + c) * step);
      }
    }
    ALIDADE_UNROLL for (; j < m; ++j) {
      Column x;
      x.Load(panel + j * step);
      ALIDADE_UNROLL for (int k = 0; k < j; ++k) {
        Column done;
        done.Load(panel + k * step);
        x.Subtract(l[std::ptrdiff_t{k} * stride + j], done);
      }
      x.Store(panel + j * step);
    }
  }
  /// dx and the variances of P' in the rows of a panel from i on.
  ALIDADE_KERNEL Solution Correct(const Update& u, int m, int i, const double* panel) {
    const SymmetricView p = Sized(u.p);
    Column dx{}, lost{};
    ALIDADE_UNROLL for (int k = 0; k < m; ++k) {
      Column w;
      w.Load(panel + k * kRows);
      dx.Add(u.inverse_d[k] * u.y[k], w);
      lost.AddSquares(u.inverse_d[k], w);
    }
    dx.Store(u.dx + i);
    lost.Store(u.lost + i);
    double defect = 0.0;  // or not a number
    bool cancels = false;
    ALIDADE_UNROLL for (int r = 0; r < kRows; ++r) {
      const double before = p.data[std::ptrdiff_t{i + r} * (p.stride + 1)];
      const double after = before - u.lost[i + r];
      defect += 0.0 * u.dx[i + r] + 0.0 * after;
      cancels |= after < kCancelled * before;
    }
    if (defect != 0.0) return Solution::kNotFinite;
    return cancels ? Solution::kCancels : Solution::kFine;
  }
  /// A panel of K from one of W.
  ALIDADE_KERNEL void Gain(const Update& u, int m, const double* panel, double* gain) {
    const int stride = PaddedSize(m);
    ALIDADE_UNROLL for (int j = m - 1; j >= 0; --j) {
      Column w, k{};
      w.Load(panel + j * kRows);
      k.Add(u.inverse_d[j], w);
      ALIDADE_UNROLL for (int i = j + 1; i < m; ++i) {
        Column done;
        done.Load(gain + i * kRows);
        k.Subtract(u.s[std::ptrdiff_t{j} * stride + i], done);
      }
      k.Store(gain + j * kRows);
    }
  }

  ALIDADE_KERNEL Solution Solve(const Update& u) {
    const int n = Sized(u.p).size, m = Rows(u.m);
    Stack(u, m);
    if (!Factorise(m, u.s, u.inverse_d)) return Solution::kNotPositiveDefinite;
    Substitute(m, u.s, u.y);
    Solution worst = Solution::kFine;
    for (int i = 0; i < n; i += kRows) {
      double* const panel = &At(u, u.w, i, 0);
      Divide(m, u.s, panel, kRows, PaddedSize(m));
      worst = std::max(worst, Correct(u, m, i, panel));
      if (u.gain != nullptr) Gain(u, m, panel, &At(u, u.gain, i, 0));
    }
    return worst;
  }

  /// P'(i, j) of kTile panels of rows from i and one of columns from j, by columns [first, last) of
  /// W; `scaled`: D^-1 times those of the panel at j.
  template <int kTile>
  ALIDADE_KERNEL void Tile(const Update& u, int first, int last, int i, int j,
                           const double* scaled) {
    const std::ptrdiff_t stride = Sized(u.p).stride;
    double* const p = u.p.data + j * stride + i;
    const double* const w = &At(u, u.w, i, 0);
    Column sum[kRows][kTile];
    ALIDADE_UNROLL for (int c = 0; c < kRows; ++c) {
      ALIDADE_UNROLL for (int t = 0; t < kTile; ++t) sum[c][t].Load(p + c * stride + t * kRows);
    }
    ALIDADE_UNROLL for (int k = first; k < last; ++k) {
      Column left[kTile];
      ALIDADE_UNROLL for (int t = 0; t < kTile; ++t) {
        left[t].Load(w + (std::ptrdiff_t{t} * u.capacity + k) * kRows);
      }
      ALIDADE_UNROLL for (int c = 0; c < kRows; ++c) {
        ALIDADE_UNROLL for (int t = 0; t < kTile; ++t) {
          sum[c][t].Subtract(scaled[(k - first) * kRows + c], left[t]);
        }
      }
    }
    ALIDADE_UNROLL for (int c = 0; c < kRows; ++c) {
      ALIDADE_UNROLL for (int t = 0; t < kTile; ++t) sum[c][t].Store(p + c * stride + t * kRows);
    }
  }
  /// P' in blocks of rows and columns of W that stay in the second cache.
  ALIDADE_KERNEL void Downdate(const Update& u) {
    constexpr int kDepth = 256, kHeight = kStates > 0 ? kRows : 24 * kHigh * kRows;
    const int n = Sized(u.p).size, m = Rows(u.m);
    double scaled[(M > 0 ? M : kDepth) * kRows];
    for (int first = 0; first < m; first += kDepth) {
      const int last = M > 0 ? M : std::min(first + kDepth, m);
      for (int block = 0; block < n; block += kHeight) {
        const int end = std::min(block + kHeight, n);
        for (int j = 0; j < end; j += kRows) {
          ALIDADE_UNROLL for (int k = first; k < last; ++k) {
            Column w, column{};
            w.Load(&At(u, u.w, j, k));
            column.Add(u.inverse_d[k], w);
            column.Store(scaled + (k - first) * kRows);
          }
          int i = std::max(block, j);
          for (; i + kHigh * kRows <= end; i += kHigh * kRows) {
            Tile<kHigh>(u, first, last, i, j, scaled);
          }
          for (; i < end; i += kRows) Tile<1>(u, first, last, i, j, scaled);
        }
      }
    }
  }

  /// For up to two rows of a small state, K of them, all in registers.
  template <int K>
  ALIDADE_KERNEL bool PropagateFew(const SymmetricView& whole, const Transition& step) {
    const SymmetricView p = Sized(whole);
    constexpr int n = kStates;
    const int* const rows = step.rows.data();
    double before[K * n], moved[K * n], own[K * K], defect = 0.0;  // P_a, F P_a
    ALIDADE_UNROLL for (int c = 0; c < K; ++c) {
      ALIDADE_UNROLL for (int i = 0; i < n; ++i) before[c * n + i] = p(rows[c], i);
    }
    ALIDADE_UNROLL for (int r = 0; r < K; ++r) {
      Column sum{};
      ALIDADE_UNROLL for (int c = 0; c < K; ++c) {
        Column row;
        row.Load(before + c * n);
        sum.Add(step.f[r * K + c], row);
      }
      sum.Store(moved + r * n);
    }
    ALIDADE_UNROLL for (int r = 0; r < K; ++r) {
      ALIDADE_UNROLL for (int c = 0; c <= r; ++c) {
        double sum = NoiseOf(step, r, c);
        ALIDADE_UNROLL for (int j = 0; j < K; ++j) {
          sum += moved[r * n + rows[j]] * step.f[c * K + j];
        }
        own[r * K + c] = sum;
      }
      defect += 0.0 * own[r * K + r];
    }
    if (defect != 0.0) return false;
    ALIDADE_UNROLL for (int r = 0; r < K; ++r) {
      ALIDADE_UNROLL for (int i = 0; i < n; ++i) p(rows[r], i) = moved[r * n + i];
    }
    ALIDADE_UNROLL for (int r = 0; r < K; ++r) {
      ALIDADE_UNROLL for (int c = 0; c <= r; ++c) p(rows[r], rows[c]) = own[r * K + c];
    }
    return true;
  }
  /// Element (r, c) of N N' + C + C'.
  ALIDADE_KERNEL double NoiseOf(const Transition& step, int r, int c) {
    const int width = step.width;
    const double *const a = step.noise + r * width, *const b = step.noise + c * width;
    double sum = width > 0 ? a[0] * b[0] : 0.0;
    for (int k = 1; k < width; ++k) sum += a[k] * b[k];
    if (step.cross == nullptr) return sum;
    const int k = static_cast<int>(step.rows.size());
    return sum + step.cross[r * k + c] + step.cross[c * k + r];
  }
  /// c += a b, row-major: a rows x inner, b inner x PaddedSize(k), c rows x PaddedSize(k).
  ALIDADE_KERNEL void AddProduct(int rows, int inner, int k, const double* a, const double* b,
                                 double* c) {
    for (int i = 0; i < k; i += kRows) {
      int r = 0;
      for (; r + 3 <= rows; r += 3) AddRows<3>(r, inner, i, PaddedSize(k), a, b, c);
      for (; r < rows; ++r) AddRows<1>(r, inner, i, PaddedSize(k), a, b, c);
    }
  }
  /// The same of kAtOnce rows from r on, which share what they read of b, and columns from i on.
  template <int kAtOnce>
  ALIDADE_KERNEL void AddRows(int r, int inner, int i, int stride, const double* a, const double* b,
                              double* c) {
    double* const to = c + std::ptrdiff_t{r} * stride + i;
    Column sum[kAtOnce];
    ALIDADE_UNROLL for (int t = 0; t < kAtOnce; ++t) sum[t].Load(to + t * stride);
    for (int j = 0; j < inner; ++j) {
      Column row;
      row.Load(b + std::ptrdiff_t{j} * stride + i);
      ALIDADE_UNROLL for (int t = 0; t < kAtOnce; ++t) sum[t].Add(a[(r + t) * inner + j], row);
    }
    ALIDADE_UNROLL for (int t = 0; t < kAtOnce; ++t) sum[t].Store(to + t * stride);
  }
  /// Row `row` of P to `to`, PaddedSize(n) numbers.
  ALIDADE_KERNEL void CopyRow(const SymmetricView& p, int row, double* to) {
    for (int i = 0; i < p.size; i += kRows) ColumnOf(p, row, i).Store(to + i);
  }
  ALIDADE_KERNEL bool PropagateMany(const SymmetricView& whole, const Transition& step) {
    const SymmetricView p = Sized(whole);
    const int n = p.size, k = static_cast<int>(step.rows.size()), w = step.width;
    const int* const rows = step.rows.data();
    double* next = step.memory;
    const auto take = [&](int height, int width) {
      return std::exchange(next, next + std::ptrdiff_t{height} * width);
    };
    double *const before = take(k, PaddedSize(n)), *const moved = take(k, PaddedSize(n)),
                  *const own = take(k, PaddedSize(k)), *const f_transposed = take(k, PaddedSize(k)),
                  *const noise_transposed = take(w, PaddedSize(k)), *const among = take(k, k);
    for (int c = 0; c < k; ++c) CopyRow(p, rows[c], before + std::ptrdiff_t{c} * PaddedSize(n));
    std::fill(moved, f_transposed, 0.0);
    AddProduct(k, k, n, step.f, before, moved);
    for (int r = 0; r < k; ++r) {
      for (int j = 0; j < k; ++j) {
        f_transposed[j * PaddedSize(k) + r] = step.f[r * k + j];
        among[r * k + j] = moved[r * PaddedSize(n) + rows[j]];
      }
      for (int j = 0; j < w; ++j) noise_transposed[j * PaddedSize(k) + r] = step.noise[r * w + j];
    }
    AddProduct(k, w, k, step.noise, noise_transposed, own);
    for (int r = 0; step.cross != nullptr && r < k; ++r) {
      for (int c = 0; c <= r; ++c) {
        own[r * PaddedSize(k) + c] += step.cross[r * k + c];
        own[r * PaddedSize(k) + c] += step.cross[c * k + r];
      }
    }
    AddProduct(k, k, k, among, f_transposed, own);
    double defect = 0.0;
    for (int r = 0; r < k; ++r) defect += 0.0 * own[r * (PaddedSize(k) + 1)];
    if (defect != 0.0) return false;
    for (int r = 0; r < k; ++r) {
      const double* const from = moved + std::ptrdiff_t{r} * PaddedSize(n);
      double* const column = p.data + std::ptrdiff_t{rows[r]} * p.stride;
      for (int i = 0; i < rows[r]; ++i) p.data[std::ptrdiff_t{i} * p.stride + rows[r]] = from[i];
      for (int i = rows[r]; i < n; ++i) column[i] = from[i];
    }
    for (int r = 0; r < k; ++r) {
      for (int c = 0; c <= r; ++c) p(rows[r], rows[c]) = own[r * PaddedSize(k) + c];
    }
    return true;
  }
  ALIDADE_KERNEL bool Propagate(const SymmetricView& p, const Transition& step) {
    if constexpr (kStates >= 1) {
      if (step.rows.size() == 1) return PropagateFew<1>(p, step);
    }
    if constexpr (kStates >= 2) {
      if (step.rows.size() == 2) return PropagateFew<2>(p, step);
    }
    return PropagateMany(p, step);
  }
};

/// The table of one Column, compiled for an instruction set.
#define ALIDADE_KERNEL_TABLE(table, target, text)                                  \
  template <class Column>                                                          \
  struct table {                                                                   \
    template <int M>                                                               \
    target static double ComputeNis(const Update& u, const MeasurementRows& one) { \
      return Arithmetic<Column, M>::ComputeNis(u, one);                            \
    }                                                                              \
    template <int M>                                                               \
    target static Solution Solve(const Update& u) {                                \
      return Arithmetic<Column, M>::Solve(u);                                      \
    }                                                                              \
    template <int M>                                                               \
    target static void Downdate(const Update& u) {                                 \
      Arithmetic<Column, M>::Downdate(u);                                          \
    }                                                                              \
    target static bool Propagate(const SymmetricView& p, const Transition& step) { \
      return Arithmetic<Column, 0>::Propagate(p, step);                            \
    }                                                                              \
    static constexpr Kernels kTable{text,                                          \
                                    Column::kRows,                                 \
                                    {ComputeNis<1>, ComputeNis<2>, ComputeNis<0>}, \
                                    {Solve<1>, Solve<2>, Solve<0>},                \
                                    {Downdate<1>, Downdate<2>, Downdate<0>},       \
                                    Propagate};                                    \
  };
ALIDADE_KERNEL_TABLE(Baseline, , "baseline")
#if defined(__x86_64__)
ALIDADE_KERNEL_TABLE(Avx2, [[gnu::target("avx2,fma")]], "AVX2")
ALIDADE_KERNEL_TABLE(Avx512, [[gnu::target("avx512f,avx2,fma")]], "AVX-512")
#endif

template <int... N>
constexpr std::array<const Kernels*, kSmall + 1> SmallKernels(std::integer_sequence<int, N...>) {
  return {nullptr, &Baseline<Scalars<N + 1>>::kTable...};
}

}  // namespace

const Kernels& KernelsFor(const SymmetricView& p) {
  static constexpr auto kTables = SmallKernels(std::make_integer_sequence<int, kSmall>());
  static const Kernels& vectors = KernelsOf(BestInstructionSet());
  const bool small = p.stride == kSmall && p.size > 0;
  return small ? *kTables[static_cast<std::size_t>(p.size)] : vectors;
}

const Kernels& KernelsOf([[maybe_unused]] InstructionSet set) {
#if defined(__x86_64__)
  if (set == InstructionSet::kAvx512) return Avx512<Vector<8>>::kTable;
  if (set == InstructionSet::kAvx2) return Avx2<Vector<4>>::kTable;
#endif
  return Baseline<Vector<2>>::kTable;
}

}  // namespace alidade::internal
