// SPDX-License-Identifier: Apache-2.0
#include "alidade/state/kernels.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <utility>

#include "alidade/base/all_finite.h"

// g++ warns that the ABI for vector arguments differs. The warning does not apply, because only
// inlined functions have such arguments.
#pragma GCC diagnostic ignored "-Wpsabi"

#define ALIDADE_KERNEL [[gnu::always_inline]] static inline
#define ALIDADE_UNROLL _Pragma("GCC unroll 8")

namespace alidade::internal {
namespace {

constexpr int kSmall = 8;

/// If an update reduces a variance below this fraction of its old value, the new value has lost
/// nearly all digits.
constexpr double kCancelled = 1e-10;

/// Returns true if x is positive and finite.
inline bool IsPositive(double x) { return x > 0.0 && x < std::numeric_limits<double>::infinity(); }

/// Column of all N states of a small filter, processed number by number. A vector load would be
/// slower: it would wait for the preceding stores of single numbers.
template <int N>
struct Scalars {
  static constexpr int kRows = N, kStates = N;
  double v[N];

  void Load(const double* source) { ALIDADE_UNROLL for (int i = 0; i < N; ++i) v[i] = source[i]; }
  void Store(double* destination) const {
    ALIDADE_UNROLL for (int i = 0; i < N; ++i) destination[i] = v[i];
  }
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

/// Column of N states of a large filter, in one vector register.
template <int N>
struct Vector {
  static constexpr int kRows = N, kStates = 0;
  using Register [[gnu::vector_size(N * sizeof(double))]] = double;
  Register v;

  [[gnu::always_inline]] void Load(const double* source) { std::memcpy(&v, source, sizeof v); }
  [[gnu::always_inline]] void Store(double* destination) const {
    std::memcpy(destination, &v, sizeof v);
  }
  [[gnu::always_inline]] void Add(double k, const Vector& x) { v += k * x.v; }
  [[gnu::always_inline]] void Subtract(double k, const Vector& x) { v -= k * x.v; }
  [[gnu::always_inline]] void AddSquares(double k, const Vector& x) { v += k * x.v * x.v; }
};

/// Kernels for panels of Column::kRows rows and for updates of M rows. M = 0 means any number.
template <class Column, int M>
struct Arithmetic {
  static constexpr int kRows = Column::kRows, kStates = Column::kStates;
  /// Height of a tile of the downdate, in panels. With this height, a tile has enough independent
  /// sums to fill the pipelines.
  static constexpr int kTileHeight = kStates > 0 ? 1 : 2;

  // These functions return the size of a small state or update as a constant that the compiler
  // knows.
  ALIDADE_KERNEL SymmetricView Sized(const SymmetricView& p) {
    return kStates > 0 ? SymmetricView{p.data, kStates, kSmall} : p;
  }
  ALIDADE_KERNEL int Rows(int m) { return M > 0 ? M : m; }
  /// Returns element (i, j) of a matrix in panels.
  ALIDADE_KERNEL double& At(const Update& u, double* panels, int i, int j) {
    if (kStates > 0) return panels[j * kRows + i];
    const int row = i % kRows;
    return panels[std::ptrdiff_t{i - row} * u.capacity + std::ptrdiff_t{j} * kRows + row];
  }

  /// Computes y += k x for n numbers.
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
  /// Factorises S = L D L' in place. S is m x m and column-major; only its lower triangle is read.
  /// Returns false unless S is positive definite.
  ALIDADE_KERNEL bool Factorise(int m, double* s, double* inverse_d) {
    const int stride = PaddedSize(m);
    int begin = 0;
    for (; kStates == 0 && begin + kRows <= m; begin += kRows) {  // rows [begin, begin + kRows)
      Divide(begin, s, s + begin, stride, stride);
      double* const diagonal_block = s + std::ptrdiff_t{begin} * stride + begin;
      Column x[kRows];
      ALIDADE_UNROLL for (int c = 0; c < kRows; ++c) x[c].Load(diagonal_block + c * stride);
      for (int k = 0; k < begin; ++k) {
        double* const l = s + std::ptrdiff_t{k} * stride + begin;
        Column unscaled, scaled{};
        unscaled.Load(l);
        scaled.Add(inverse_d[k], unscaled);
        scaled.Store(l);
        ALIDADE_UNROLL for (int c = 0; c < kRows; ++c) x[c].Subtract(l[c], unscaled);
      }
      ALIDADE_UNROLL for (int c = 0; c < kRows; ++c) x[c].Store(diagonal_block + c * stride);
      if (!FactoriseBlock(kRows, diagonal_block, stride, inverse_d + begin)) return false;
    }
    for (int i = begin; kStates == 0 && i < m; ++i) {  // processes the last rows one by one
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
        const double unscaled = l;
        l *= inverse_d[k];
        *pivot -= l * unscaled;
      }
      if (!IsPositive(*pivot)) return false;
      inverse_d[i] = 1.0 / *pivot;
    }
    return kStates == 0 || FactoriseBlock(m, s, stride, inverse_d);
  }
  /// Factorises a block of a few rows like Factorise(), column by column.
  ALIDADE_KERNEL bool FactoriseBlock(int m, double* s, int stride, double* inverse_d) {
    ALIDADE_UNROLL for (int k = 0; k < m; ++k) {
      double* const l = s + std::ptrdiff_t{k} * stride;
      if (!IsPositive(l[k])) return false;
      inverse_d[k] = 1.0 / l[k];
      // Updates the columns to the right; l still contains L D.
      ALIDADE_UNROLL for (int j = k + 1; j < m; ++j) {
        const double factor = -l[j] * inverse_d[k];
        ALIDADE_UNROLL for (int i = j; i < m; ++i) s[std::ptrdiff_t{j} * stride + i] +=
            factor * l[i];
      }
      ALIDADE_UNROLL for (int i = k + 1; i < m; ++i) l[i] *= inverse_d[k];
    }
    return true;
  }
  /// Computes y <- L^-1 y.
  ALIDADE_KERNEL void Substitute(int m, const double* l, double* y) {
    const int stride = PaddedSize(m);
    ALIDADE_UNROLL for (int k = 0; k + 1 < m; ++k) {
      AddScaled(m - k - 1, -y[k], l + std::ptrdiff_t{k} * stride + k + 1, y + k + 1);
    }
  }

  /// Returns rows [i, i + kRows) of column c of P.
  ALIDADE_KERNEL Column ColumnOf(const SymmetricView& p, int c, int i) {
    Column column;
    if (kStates == 0 && c <= i) {
      column.Load(p.data + std::ptrdiff_t{c} * p.stride + i);
    } else {
      double rows[kRows];
      const double* const source = p.data + std::ptrdiff_t{i} * p.stride + c;
      if (kStates == 0 && c >= i + kRows) {
        ALIDADE_UNROLL for (int r = 0; r < kRows; ++r) {
          rows[r] = source[std::ptrdiff_t{r} * p.stride];
        }
      } else {
        ALIDADE_UNROLL for (int r = 0; r < kRows; ++r) rows[r] = p(i + r, c);
      }
      column.Load(rows);
    }
    return column;
  }
  /// Computes P H' for rows [first, last) of H, kBatch rows at a time. Writes the result to the
  /// columns of w from `first_column` on.
  template <int kBatch>
  ALIDADE_KERNEL void ProjectRows(const Update& u, const JacobianRows& rows, int first, int last,
                                  int first_column) {
    const SymmetricView p = Sized(u.p);
    const int width = rows.width();
    const int* const columns = rows.columns.data();
    for (int i = 0; i < p.size; i += kRows) {
      double* const pht = &At(u, u.w, i, first_column);
      for (int r = first; r < last; r += kBatch) {
        Column sum[kBatch]{};
        for (int c = 0; c < width; ++c) {
          const Column column = ColumnOf(p, columns[c], i);
          ALIDADE_UNROLL for (int k = 0; k < kBatch; ++k) {
            sum[k].Add(rows.data[(r + k) * width + c], column);
          }
        }
        ALIDADE_UNROLL for (int k = 0; k < kBatch; ++k) sum[k].Store(pht + (r + k) * kRows);
      }
    }
  }
  ALIDADE_KERNEL void Project(const Update& u, const JacobianRows& rows, int m, int first_column) {
    if (M > 0) return ProjectRows<std::max(M, 1)>(u, rows, 0, m, first_column);
    // Most measurements with more than two rows have three.
    constexpr int kBatch = kStates > 0 ? 1 : 3;
    const int batched = m - m % kBatch;
    ProjectRows<kBatch>(u, rows, 0, batched, first_column);
    if (kBatch > 1) ProjectRows<1>(u, rows, batched, m, first_column);
  }
  ALIDADE_KERNEL double ComputeNis(const Update& u, const MeasurementRows& measurement) {
    const int m = Rows(measurement.h.rows), width = measurement.h.width();
    const double* const h = measurement.h.data;
    const int* const columns = measurement.h.columns.data();
    double* const s = measurement.s;
    Project(u, measurement.h, m, measurement.column);
    ALIDADE_UNROLL for (int i = 0; i < m; ++i) {
      ALIDADE_UNROLL for (int j = 0; j <= i; ++j) {
        double sum = measurement.noise[i * m + j];
        for (int c = 0; c < width; ++c) {
          sum += h[i * width + c] * At(u, u.w, columns[c], measurement.column + j);
        }
        s[i * m + j] = s[j * m + i] = sum;
      }
    }
    const double* const r = measurement.innovation;
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

  /// Computes the lower triangle of S, and copies the innovations.
  ALIDADE_KERNEL void Stack(const Update& u, int m) {
    const int stride = PaddedSize(m);
    for (const MeasurementRows* const pointer : u.measurements) {
      const MeasurementRows& measurement = *pointer;
      const int begin = measurement.column, rows = measurement.h.rows;
      if (begin > 0) StackCrossTerms(u, measurement, stride);
      for (int r = 0; r < rows; ++r) {
        for (int j = 0; j <= r; ++j) {
          u.s[std::ptrdiff_t{begin + j} * stride + begin + r] = measurement.s[r * rows + j];
        }
        u.y[begin + r] = measurement.innovation[r];
      }
    }
  }
  /// Multiplies H of a measurement by P H' of the preceding measurements. Processes a few columns
  /// of H at a time.
  ALIDADE_KERNEL void StackCrossTerms(const Update& u, const MeasurementRows& measurement,
                                      int stride) {
    constexpr int kBatch = 16;
    const int begin = measurement.column, rows = measurement.h.rows, width = measurement.h.width();
    const int* const columns = measurement.h.columns.data();
    for (int r = 0; kStates > 0 && r < rows; ++r) {
      const double* const h = measurement.h.data + r * width;
      for (int j = 0; j < begin; ++j) {
        double sum = 0.0;
        for (int c = 0; c < width; ++c) sum += h[c] * At(u, u.w, columns[c], j);
        u.s[std::ptrdiff_t{j} * stride + begin + r] = sum;
      }
    }
    for (int first = 0; kStates == 0 && first < width; first += kBatch) {
      const int count = std::min(kBatch, width - first);
      const double* source[kBatch];
      for (int c = 0; c < count; ++c) {
        source[c] = &At(u, u.w, columns[first + c], 0);
      }
      for (int r = 0; r < rows; ++r) {
        const double* const h = measurement.h.data + r * width + first;
        double* const s = u.s + begin + r;
        for (int j = 0; j < begin; ++j) {
          double sum = first == 0 ? 0.0 : s[std::ptrdiff_t{j} * stride];
          for (int c = 0; c < count; ++c) sum += h[c] * source[c][j * kRows];
          s[std::ptrdiff_t{j} * stride] = sum;
        }
      }
    }
  }
  /// Converts rows of P H' to rows of W, kRows columns at a time. Adjacent columns are `step`
  /// numbers apart.
  ALIDADE_KERNEL void Divide(int m, const double* l, double* panel, int step, int stride) {
    int j = 0;
    for (; kStates == 0 && j + kRows <= m; j += kRows) {
      Column x[kRows];
      ALIDADE_UNROLL for (int c = 0; c < kRows; ++c) x[c].Load(panel + (j + c) * step);
      for (int k = 0; k < j; ++k) {
        Column solved;
        solved.Load(panel + k * step);
        const double* const row = l + std::ptrdiff_t{k} * stride + j;
        ALIDADE_UNROLL for (int c = 0; c < kRows; ++c) x[c].Subtract(row[c], solved);
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
        Column solved;
        solved.Load(panel + k * step);
        x.Subtract(l[std::ptrdiff_t{k} * stride + j], solved);
      }
      x.Store(panel + j * step);
    }
  }
  /// Computes dx and the decrease of the variances for the rows of the panel that begins at row i.
  ALIDADE_KERNEL Solution Correct(const Update& u, int m, int i, const double* panel) {
    const SymmetricView p = Sized(u.p);
    Column dx{}, decrease{};
    ALIDADE_UNROLL for (int k = 0; k < m; ++k) {
      Column w;
      w.Load(panel + k * kRows);
      dx.Add(u.inverse_d[k] * u.y[k], w);
      decrease.AddSquares(u.inverse_d[k], w);
    }
    dx.Store(u.dx + i);
    decrease.Store(u.variance_decrease + i);
    double defect = 0.0;  // becomes NaN if a result is not finite
    bool has_cancellation = false;
    ALIDADE_UNROLL for (int r = 0; r < kRows; ++r) {
      const double prior = p.data[std::ptrdiff_t{i + r} * (p.stride + 1)];
      const double posterior = prior - u.variance_decrease[i + r];
      defect += 0.0 * u.dx[i + r] + 0.0 * posterior;
      has_cancellation |= posterior < kCancelled * prior;
    }
    if (defect != 0.0) return Solution::kNotFinite;
    return has_cancellation ? Solution::kCancellation : Solution::kOk;
  }
  /// Computes a panel of K from a panel of W.
  ALIDADE_KERNEL void Gain(const Update& u, int m, const double* panel, double* gain) {
    const int stride = PaddedSize(m);
    ALIDADE_UNROLL for (int j = m - 1; j >= 0; --j) {
      Column w, k{};
      w.Load(panel + j * kRows);
      k.Add(u.inverse_d[j], w);
      ALIDADE_UNROLL for (int i = j + 1; i < m; ++i) {
        Column solved;
        solved.Load(gain + i * kRows);
        k.Subtract(u.s[std::ptrdiff_t{j} * stride + i], solved);
      }
      k.Store(gain + j * kRows);
    }
  }

  ALIDADE_KERNEL Solution Solve(const Update& u) {
    const int n = Sized(u.p).size, m = Rows(u.m);
    Stack(u, m);
    if (!Factorise(m, u.s, u.inverse_d)) return Solution::kNotPositiveDefinite;
    Substitute(m, u.s, u.y);
    Solution worst = Solution::kOk;
    for (int i = 0; i < n; i += kRows) {
      double* const panel = &At(u, u.w, i, 0);
      Divide(m, u.s, panel, kRows, PaddedSize(m));
      worst = std::max(worst, Correct(u, m, i, panel));
      if (u.gain != nullptr) Gain(u, m, panel, &At(u, u.gain, i, 0));
    }
    return worst;
  }

  /// Subtracts from a tile of P the contribution of columns [first, last) of W. The tile has kTile
  /// panels of rows from row i on, and one panel of columns from column j on. `scaled` is W D^-1 of
  /// the panel that begins at row j.
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
      Column column[kTile];
      ALIDADE_UNROLL for (int t = 0; t < kTile; ++t) {
        column[t].Load(w + (std::ptrdiff_t{t} * u.capacity + k) * kRows);
      }
      ALIDADE_UNROLL for (int c = 0; c < kRows; ++c) {
        ALIDADE_UNROLL for (int t = 0; t < kTile; ++t) {
          sum[c][t].Subtract(scaled[(k - first) * kRows + c], column[t]);
        }
      }
    }
    ALIDADE_UNROLL for (int c = 0; c < kRows; ++c) {
      ALIDADE_UNROLL for (int t = 0; t < kTile; ++t) sum[c][t].Store(p + c * stride + t * kRows);
    }
  }
  /// Computes P' block by block. The elements of W that a block needs fit into the L2 cache.
  ALIDADE_KERNEL void Downdate(const Update& u) {
    constexpr int kDepth = 256, kHeight = kStates > 0 ? kRows : 24 * kTileHeight * kRows;
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
          for (; i + kTileHeight * kRows <= end; i += kTileHeight * kRows) {
            Tile<kTileHeight>(u, first, last, i, j, scaled);
          }
          for (; i < end; i += kRows) Tile<1>(u, first, last, i, j, scaled);
        }
      }
    }
  }

  /// Propagates K rows of a small state in registers; K is 1 or 2.
  template <int K>
  ALIDADE_KERNEL bool PropagateFew(const SymmetricView& covariance, const Transition& step) {
    const SymmetricView p = Sized(covariance);
    constexpr int n = kStates;
    const int* const rows = step.rows.data();
    double p_a[K * n], f_p_a[K * n], diagonal_block[K * K], defect = 0.0;
    ALIDADE_UNROLL for (int c = 0; c < K; ++c) {
      ALIDADE_UNROLL for (int i = 0; i < n; ++i) p_a[c * n + i] = p(rows[c], i);
    }
    ALIDADE_UNROLL for (int r = 0; r < K; ++r) {
      Column sum{};
      ALIDADE_UNROLL for (int c = 0; c < K; ++c) {
        Column row;
        row.Load(p_a + c * n);
        sum.Add(step.f[r * K + c], row);
      }
      sum.Store(f_p_a + r * n);
    }
    ALIDADE_UNROLL for (int r = 0; r < K; ++r) {
      ALIDADE_UNROLL for (int c = 0; c <= r; ++c) {
        double sum = NoiseOf(step, r, c);
        ALIDADE_UNROLL for (int j = 0; j < K; ++j) {
          sum += f_p_a[r * n + rows[j]] * step.f[c * K + j];
        }
        diagonal_block[r * K + c] = sum;
      }
      defect += 0.0 * diagonal_block[r * K + r];
    }
    if (defect != 0.0) return false;
    ALIDADE_UNROLL for (int r = 0; r < K; ++r) {
      ALIDADE_UNROLL for (int i = 0; i < n; ++i) p(rows[r], i) = f_p_a[r * n + i];
    }
    ALIDADE_UNROLL for (int r = 0; r < K; ++r) {
      ALIDADE_UNROLL for (int c = 0; c <= r; ++c) p(rows[r], rows[c]) = diagonal_block[r * K + c];
    }
    return true;
  }
  /// Returns element (r, c) of N N' + C + C'.
  ALIDADE_KERNEL double NoiseOf(const Transition& step, int r, int c) {
    const int width = step.width;
    const double *const a = step.noise + r * width, *const b = step.noise + c * width;
    double sum = width > 0 ? a[0] * b[0] : 0.0;
    for (int k = 1; k < width; ++k) sum += a[k] * b[k];
    if (step.cross == nullptr) return sum;
    const int k = static_cast<int>(step.rows.size());
    return sum + step.cross[r * k + c] + step.cross[c * k + r];
  }
  /// Computes c += a b. All matrices are row-major: a is rows x inner, b is inner x PaddedSize(k),
  /// and c is rows x PaddedSize(k).
  ALIDADE_KERNEL void AddProduct(int rows, int inner, int k, const double* a, const double* b,
                                 double* c) {
    for (int i = 0; i < k; i += kRows) {
      int r = 0;
      for (; r + 3 <= rows; r += 3) AddRows<3>(r, inner, i, PaddedSize(k), a, b, c);
      for (; r < rows; ++r) AddRows<1>(r, inner, i, PaddedSize(k), a, b, c);
    }
  }
  /// Computes c += a b for kBatch rows from row r on, and kRows columns from column i on. The rows
  /// share the loads of b.
  template <int kBatch>
  ALIDADE_KERNEL void AddRows(int r, int inner, int i, int stride, const double* a, const double* b,
                              double* c) {
    double* const destination = c + std::ptrdiff_t{r} * stride + i;
    Column sum[kBatch];
    ALIDADE_UNROLL for (int t = 0; t < kBatch; ++t) sum[t].Load(destination + t * stride);
    for (int j = 0; j < inner; ++j) {
      Column row;
      row.Load(b + std::ptrdiff_t{j} * stride + i);
      ALIDADE_UNROLL for (int t = 0; t < kBatch; ++t) sum[t].Add(a[(r + t) * inner + j], row);
    }
    ALIDADE_UNROLL for (int t = 0; t < kBatch; ++t) sum[t].Store(destination + t * stride);
  }
  /// Copies row `row` of P, which has PaddedSize(n) numbers.
  ALIDADE_KERNEL void CopyRow(const SymmetricView& p, int row, double* destination) {
    for (int i = 0; i < p.size; i += kRows) ColumnOf(p, row, i).Store(destination + i);
  }
  /// Propagates any number of rows. The intermediate matrices are in memory, not in registers.
  ALIDADE_KERNEL bool PropagateMany(const SymmetricView& covariance, const Transition& step) {
    const SymmetricView p = Sized(covariance);
    const int n = p.size, k = static_cast<int>(step.rows.size()), w = step.width;
    const int* const rows = step.rows.data();
    double* next = step.memory;
    const auto allocate = [&](int height, int width) {
      return std::exchange(next, next + std::ptrdiff_t{height} * width);
    };
    double *const p_a = allocate(k, PaddedSize(n)), *const f_p_a = allocate(k, PaddedSize(n)),
                  *const diagonal_block = allocate(k, PaddedSize(k)),
                  *const f_transposed = allocate(k, PaddedSize(k)),
                  *const noise_transposed = allocate(w, PaddedSize(k)),
                  *const f_p_aa = allocate(k, k);
    for (int c = 0; c < k; ++c) CopyRow(p, rows[c], p_a + std::ptrdiff_t{c} * PaddedSize(n));
    std::fill(f_p_a, f_transposed, 0.0);
    AddProduct(k, k, n, step.f, p_a, f_p_a);
    for (int r = 0; r < k; ++r) {
      for (int j = 0; j < k; ++j) {
        f_transposed[j * PaddedSize(k) + r] = step.f[r * k + j];
        f_p_aa[r * k + j] = f_p_a[r * PaddedSize(n) + rows[j]];
      }
      for (int j = 0; j < w; ++j) noise_transposed[j * PaddedSize(k) + r] = step.noise[r * w + j];
    }
    AddProduct(k, w, k, step.noise, noise_transposed, diagonal_block);
    for (int r = 0; step.cross != nullptr && r < k; ++r) {
      for (int c = 0; c <= r; ++c) {
        diagonal_block[r * PaddedSize(k) + c] += step.cross[r * k + c];
        diagonal_block[r * PaddedSize(k) + c] += step.cross[c * k + r];
      }
    }
    AddProduct(k, k, k, f_p_aa, f_transposed, diagonal_block);
    double defect = 0.0;
    for (int r = 0; r < k; ++r) defect += 0.0 * diagonal_block[r * (PaddedSize(k) + 1)];
    if (defect != 0.0) return false;
    for (int r = 0; r < k; ++r) {
      const double* const source = f_p_a + std::ptrdiff_t{r} * PaddedSize(n);
      double* const column = p.data + std::ptrdiff_t{rows[r]} * p.stride;
      for (int i = 0; i < rows[r]; ++i) p.data[std::ptrdiff_t{i} * p.stride + rows[r]] = source[i];
      for (int i = rows[r]; i < n; ++i) column[i] = source[i];
    }
    for (int r = 0; r < k; ++r) {
      for (int c = 0; c <= r; ++c) p(rows[r], rows[c]) = diagonal_block[r * PaddedSize(k) + c];
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

/// Defines the class template `table`: the kernels for columns of type Column, compiled for one
/// instruction set.
#define ALIDADE_KERNEL_TABLE(table, target, text)                                          \
  template <class Column>                                                                  \
  struct table {                                                                           \
    template <int M>                                                                       \
    target static double ComputeNis(const Update& u, const MeasurementRows& measurement) { \
      return Arithmetic<Column, M>::ComputeNis(u, measurement);                            \
    }                                                                                      \
    template <int M>                                                                       \
    target static Solution Solve(const Update& u) {                                        \
      return Arithmetic<Column, M>::Solve(u);                                              \
    }                                                                                      \
    template <int M>                                                                       \
    target static void Downdate(const Update& u) {                                         \
      Arithmetic<Column, M>::Downdate(u);                                                  \
    }                                                                                      \
    target static bool Propagate(const SymmetricView& p, const Transition& step) {         \
      return Arithmetic<Column, 0>::Propagate(p, step);                                    \
    }                                                                                      \
    static constexpr Kernels kTable{text,                                                  \
                                    Column::kRows,                                         \
                                    {ComputeNis<1>, ComputeNis<2>, ComputeNis<0>},         \
                                    {Solve<1>, Solve<2>, Solve<0>},                        \
                                    {Downdate<1>, Downdate<2>, Downdate<0>},               \
                                    Propagate};                                            \
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
  const bool is_small = p.stride == kSmall && p.size > 0;
  return is_small ? *kTables[static_cast<std::size_t>(p.size)] : vectors;
}

const Kernels& KernelsOf([[maybe_unused]] InstructionSet set) {
#if defined(__x86_64__)
  if (set == InstructionSet::kAvx512) return Avx512<Vector<8>>::kTable;
  if (set == InstructionSet::kAvx2) return Avx2<Vector<4>>::kTable;
#endif
  return Baseline<Vector<2>>::kTable;
}

}  // namespace alidade::internal
