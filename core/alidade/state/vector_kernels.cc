// SPDX-License-Identifier: Apache-2.0
#include "alidade/state/vector_kernels.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <memory>
#include <new>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "alidade/base/error.h"

// Vectors go from one inlined function to the next, never through a call.
#pragma GCC diagnostic ignored "-Wpsabi"

namespace alidade::internal {
namespace {

/// Numbers of any value that begin at a cache line, kept from call to call.
class Buffer {
 public:
  double* Take(long size) {
    if (size > size_) {
      const long larger = std::max(size, 2 * size_);
      data_.reset(static_cast<double*>(
          ::operator new(static_cast<std::size_t>(larger) * sizeof(double), kLine)));
      size_ = larger;
    }
    return data_.get();
  }

 private:
  static constexpr std::align_val_t kLine{64};
  struct Free {
    void operator()(double* data) const { ::operator delete(data, kLine); }
  };
  std::unique_ptr<double, Free> data_;
  long size_ = 0;
};

thread_local Buffer packed_left, packed_right;

/// Columns [first, last) of P.
struct Run {
  long first, last;
};

/// Those of n that any of the rows has, in runs as long as they are; valid until the next call.
std::span<const Run> RunsOf(std::span<const JacobianRows> rows, long n) {
  thread_local std::vector<char> has;
  thread_local std::vector<Run> runs;
  has.assign(static_cast<std::size_t>(n), char{0});
  for (const JacobianRows& h : rows) {
    for (const JacobianPart& part : h.parts) std::fill_n(has.begin() + part.offset, part.size, 1);
  }
  runs.clear();
  runs.reserve(static_cast<std::size_t>(n + 1) / 2);
  for (auto at = has.begin(); at != has.end();) {
    const auto first = std::find(at, has.end(), char{1});
    at = std::find(first, has.end(), char{0});
    if (at != first) runs.push_back({first - has.begin(), at - has.begin()});
  }
  return runs;
}

/// Vectors of `kLanes` numbers, of which a product holds kVectors x kColumns in registers.
template <int kLanes, int kVectorsOfTile, int kColumnsOfTile>
struct Loops {
  using Vector [[gnu::vector_size(kLanes * sizeof(double))]] = double;
  static constexpr int kVectors = kVectorsOfTile, kColumns = kColumnsOfTile;
  static constexpr int kRows = kVectors * kLanes;
  using Tile = Vector[kColumns][kVectors];

  // A panel of the left side stays in the second cache, one of the right side in the third.
  static constexpr long kDepth = 256, kLeftRows = kRows * (192 / kRows), kRightColumns = 768;

  [[gnu::always_inline]] static Vector Load(const double* from) {
    Vector v;
    std::memcpy(&v, from, sizeof v);
    return v;
  }
  [[gnu::always_inline]] static void Store(double* to, const Vector& v) {
    std::memcpy(to, &v, sizeof v);
  }

  /// sum += A B of the first kHeight vectors of a panel of A and kColumns columns of B, the rows of
  /// B `step` apart.
  template <int kHeight>
  [[gnu::always_inline]] static void Multiply(long depth, const double* a, const double* b,
                                              long step, Vector (&sum)[kColumns][kHeight]) {
    for (long k = 0; k < depth; ++k, a += kRows, b += step) {
      Vector left[kHeight];
#pragma GCC unroll 8
      for (int v = 0; v < kHeight; ++v) left[v] = Load(a + v * kLanes);
#pragma GCC unroll 8
      for (int c = 0; c < kColumns; ++c) {
#pragma GCC unroll 8
        for (int v = 0; v < kHeight; ++v) sum[c][v] += left[v] * b[c];
      }
    }
  }

  /// Panels of kRows rows of A, one after the other, zeros below its last row.
  [[gnu::always_inline]] static void PackLeft(long rows, long depth, const double* a,
                                              const Strided& steps, double* to) {
    for (long i = 0; i < rows; i += kRows) {
      const long count = std::min<long>(kRows, rows - i);
      for (long k = 0; k < depth; ++k, to += kRows) {
        const double* from = a + i * steps.row_step + k * steps.column_step;
        if (count == kRows && steps.row_step == 1) {
#pragma GCC unroll 8
          for (int v = 0; v < kVectors; ++v) Store(to + v * kLanes, Load(from + v * kLanes));
          continue;
        }
        if (count < kRows) {
#pragma GCC unroll 8
          for (int v = 0; v < kVectors; ++v) Store(to + v * kLanes, Vector{});
        }
        for (long r = 0; r < count; ++r) to[r] = from[r * steps.row_step];
      }
    }
  }

  /// Panels of kColumns columns of sign B, zeros to the right of its last column.
  [[gnu::always_inline]] static void PackRight(long columns, long depth, const double* b,
                                               const Strided& steps, double sign, double* to) {
    for (long j = 0; j < columns; j += kColumns) {
      const long count = std::min<long>(kColumns, columns - j);
      for (long k = 0; k < depth; ++k, to += kColumns) {
        const double* from = b + k * steps.row_step + j * steps.column_step;
        if (count == kColumns && steps.column_step == 1) {
#pragma GCC unroll 8
          for (int c = 0; c < kColumns; c += kLanes) Store(to + c, sign * Load(from + c));
          continue;
        }
        for (long c = 0; c < count; ++c) to[c] = sign * from[c * steps.column_step];
        for (long c = count; c < kColumns; ++c) to[c] = 0.0;
      }
    }
  }

  /// C += sum where C has `rows` and `columns` of the tile, and of `lower` only what lies on or
  /// below its diagonal, which begins `shift` rows above the tile's first row.
  [[gnu::always_inline]] static void AddTile(const Tile& sum, long rows, long columns, bool whole,
                                             long shift, double* c, long ldc) {
    if (whole && rows == kRows && columns == kColumns) {
#pragma GCC unroll 8
      for (int j = 0; j < kColumns; ++j) {
#pragma GCC unroll 8
        for (int v = 0; v < kVectors; ++v) {
          double* const to = c + j * ldc + v * kLanes;
          Store(to, Load(to) + sum[j][v]);
        }
      }
      return;
    }
    double numbers[kColumns][kRows];
    std::memcpy(numbers, sum, sizeof numbers);
    for (long j = 0; j < columns; ++j) {
      for (long i = whole ? 0 : std::max(0L, j - shift); i < rows; ++i) {
        c[i + j * ldc] += numbers[j][i];
      }
    }
  }

  [[gnu::always_inline]] static void AddProduct(long rows, long columns, long depth,
                                                const Strided& a, const Strided& b, double* c,
                                                long ldc, double sign, bool lower) {
    const long width = std::min(depth, kDepth);
    double* const left = packed_left.Take((std::min(rows, kLeftRows) + kRows) * width);
    double* const right = packed_right.Take((std::min(columns, kRightColumns) + kColumns) * width);
    for (long j = 0; j < columns; j += kRightColumns) {
      const long wide = std::min(kRightColumns, columns - j);
      for (long k = 0; k < depth; k += kDepth) {
        const long deep = std::min(kDepth, depth - k);
        PackRight(wide, deep, b.data + k * b.row_step + j * b.column_step, b, sign, right);
        for (long i = lower ? j : 0; i < rows; i += kLeftRows) {
          const long high = std::min(kLeftRows, rows - i);
          PackLeft(high, deep, a.data + i * a.row_step + k * a.column_step, a, left);
          for (long q = 0; q < wide; q += kColumns) {
            for (long p = 0; p < high; p += kRows) {
              const long shift = i + p - (j + q);  // of the tile below C's diagonal
              if (lower && shift + kRows <= 0) continue;
              Tile sum = {};
              Multiply(deep, left + p * deep, right + q * deep, kColumns, sum);
              AddTile(sum, std::min<long>(kRows, high - p), std::min<long>(kColumns, wide - q),
                      !lower || shift >= kColumns - 1, shift, c + i + p + (j + q) * ldc, ldc);
            }
          }
        }
      }
    }
  }

  /// kCount columns of the first kHeight vectors of a panel, `own`, less what its columns
  /// [begin, end) take from them by those rows of L that `l` begins with.
  template <int kHeight, int kCount>
  [[gnu::always_inline]] static void SubtractColumns(long begin, long end, const double* l,
                                                     long ldl, const double* panel, double* own) {
    Vector x[kCount][kHeight];
#pragma GCC unroll 8
    for (int c = 0; c < kCount; ++c) {
#pragma GCC unroll 8
      for (int v = 0; v < kHeight; ++v) x[c][v] = Load(own + c * kRows + v * kLanes);
    }
    for (long k = begin; k < end; ++k) {
      Vector done[kHeight];
#pragma GCC unroll 8
      for (int v = 0; v < kHeight; ++v) done[v] = Load(panel + k * kRows + v * kLanes);
#pragma GCC unroll 8
      for (int c = 0; c < kCount; ++c) {
#pragma GCC unroll 8
        for (int v = 0; v < kHeight; ++v) x[c][v] -= done[v] * l[c + k * ldl];
      }
    }
#pragma GCC unroll 8
    for (int c = 0; c < kCount; ++c) {
#pragma GCC unroll 8
      for (int v = 0; v < kHeight; ++v) Store(own + c * kRows + v * kLanes, x[c][v]);
    }
  }

  /// kCount columns of the first kHeight vectors of a panel, `own`, times L^-T of as many rows.
  template <int kHeight, int kCount>
  [[gnu::always_inline]] static void DivideColumns(const double* l, long ldl, double* own) {
    Vector x[kCount][kHeight];
#pragma GCC unroll 8
    for (int c = 0; c < kCount; ++c) {
#pragma GCC unroll 8
      for (int v = 0; v < kHeight; ++v) x[c][v] = Load(own + c * kRows + v * kLanes);
#pragma GCC unroll 8
      for (int d = 0; d < c; ++d) {
#pragma GCC unroll 8
        for (int v = 0; v < kHeight; ++v) x[c][v] -= x[d][v] * l[c + d * ldl];
      }
      const double reciprocal = 1.0 / l[c + c * ldl];
#pragma GCC unroll 8
      for (int v = 0; v < kHeight; ++v) {
        x[c][v] *= reciprocal;
        Store(own + c * kRows + v * kLanes, x[c][v]);
      }
    }
  }

  template <int kHeight, int kCount>
  [[gnu::always_inline]] static void SolveColumns(long j, long k, bool last, const double* l,
                                                  long ldl, double* panel) {
    double* const own = panel + j * kRows;
    SubtractColumns<kHeight, kCount>(k, std::min(k + kDepth, j), l + j, ldl, panel, own);
    if (last) DivideColumns<kHeight, kCount>(l + j + j * ldl, ldl, own);
  }

  /// Columns [first, first + count) of the first kHeight vectors of a panel of B L^-T, as far as
  /// columns [k, k + kDepth) go, which are done but for those from `first` on.
  template <int kHeight>
  [[gnu::always_inline]] static void SolvePanel(long first, long count, long k, const double* l,
                                                long ldl, double* panel) {
    const bool last = k == first;
    long j = first;
    for (; j + kColumns <= first + count; j += kColumns) {
      SolveColumns<kHeight, kColumns>(j, k, last, l, ldl, panel);
    }
    if (j + 4 <= first + count) {
      SolveColumns<kHeight, 4>(j, k, last, l, ldl, panel);
      j += 4;
    }
    if (j + 2 <= first + count) {
      SolveColumns<kHeight, 2>(j, k, last, l, ldl, panel);
      j += 2;
    }
    if (j < first + count) SolveColumns<kHeight, 1>(j, k, last, l, ldl, panel);
  }

  [[gnu::always_inline]] static void DividePanels(long rows, long m, const double* l, long ldl,
                                                  double* panels) {
    for (long first = 0; first < m; first += kDepth) {
      const long count = std::min(kDepth, m - first);
      for (long k = 0; k <= first; k += kDepth) {
        for (long i = 0; i < rows; i += kRows) {
          const long vectors = (rows - i + kLanes - 1) / kLanes;
          double* const panel = panels + i * m;
          if (vectors >= kVectors) {
            SolvePanel<kVectors>(first, count, k, l, ldl, panel);
          } else if (vectors == 2) {
            SolvePanel<2>(first, count, k, l, ldl, panel);
          } else {
            SolvePanel<1>(first, count, k, l, ldl, panel);
          }
        }
      }
    }
  }

  [[gnu::always_inline]] static void DivideByTransposed(long rows, long m, const double* l,
                                                        long ldl, double* b, long ldb) {
    double* const panels = packed_left.Take((rows + kRows) * m);
    PackLeft(rows, m, b, {nullptr, 1, ldb}, panels);
    DividePanels(rows, m, l, ldl, panels);
    for (long i = 0; i < rows; i += kRows) {
      const auto bytes = static_cast<std::size_t>(std::min<long>(kRows, rows - i)) * sizeof(double);
      for (long j = 0; j < m; ++j) {
        std::memcpy(b + i + j * ldb, panels + i * m + j * kRows, bytes);
      }
    }
  }

  /// C -= A B of kHeight vectors of a panel and kColumns rows of a panel, as B' has them, where C
  /// has `rows` and `columns` of it and on or below its diagonal, which begins `shift` rows above.
  template <int kHeight>
  [[gnu::always_inline]] static void SubtractTile(long depth, const double* a, const double* b,
                                                  long rows, long columns, long shift, double* c,
                                                  long ldc) {
    Vector sum[kColumns][kHeight] = {};
    Multiply(depth, a, b, kRows, sum);
#pragma GCC unroll 8
    for (int j = 0; j < kColumns; ++j) {
      if (j >= columns) return;
#pragma GCC unroll 8
      for (int v = 0; v < kHeight; ++v) {
        double* const to = c + j * ldc + v * kLanes;
        if (j - shift <= v * kLanes && (v + 1) * kLanes <= rows) {
          Store(to, Load(to) - sum[j][v]);
          continue;
        }
        for (long i = std::max(0L, j - shift - v * kLanes);
             i < std::min<long>(kLanes, rows - v * kLanes); ++i) {
          to[i] -= sum[j][v][i];
        }
      }
    }
  }

  /// C -= W W' for rows [i, i + kRows) and columns [j, j + kColumns), of the given depth.
  [[gnu::always_inline]] static void SubtractTile(long i, long j, long n, long depth,
                                                  const double* left, const double* right,
                                                  double* c, long ldc) {
    // Vectors that lie above the diagonal, or below the last row, are left out.
    const long skip = std::max(0L, (j - i) / kLanes);
    const long vectors = std::min<long>(kVectors, (n - i + kLanes - 1) / kLanes) - skip;
    const long first = i + skip * kLanes, rows = n - first, columns = n - j, shift = first - j;
    left += skip * kLanes;
    c += first + j * ldc;
    if (vectors >= kVectors) {
      SubtractTile<kVectors>(depth, left, right, rows, columns, shift, c, ldc);
    } else if (vectors == 2) {
      SubtractTile<2>(depth, left, right, rows, columns, shift, c, ldc);
    } else if (vectors == 1) {
      SubtractTile<1>(depth, left, right, rows, columns, shift, c, ldc);
    }
  }

  [[gnu::always_inline]] static void SubtractOuterProduct(long n, long m, const double* panels,
                                                          double* c, long ldc) {
    for (long k = 0; k < m; k += kDepth) {
      const double* const from = panels + k * kRows;
      for (long block = 0; block < n; block += kLeftRows) {
        const long end = std::min(block + kLeftRows, n);
        for (long j = 0; j < end; j += kColumns) {
          const long panel = j / kRows * kRows;
          for (long i = std::max(block, panel); i < end; i += kRows) {
            SubtractTile(i, j, n, std::min(kDepth, m - k), from + i * m,
                         from + panel * m + j - panel, c, ldc);
          }
        }
      }
    }
  }

  [[gnu::always_inline]] static void MultiplyPanels(long rows, long m, const double* panels,
                                                    const double* x, double* product,
                                                    double* squares) {
    for (long at = 0; at < rows; at += kRows) {
      const double* from = panels + at * m;
      Vector sum[2][kVectors] = {};
      for (long k = 0; k < m; ++k, from += kRows) {
#pragma GCC unroll 8
        for (int v = 0; v < kVectors; ++v) {
          const Vector a = Load(from + v * kLanes);
          sum[0][v] += a * x[k];
          sum[1][v] += a * a;
        }
      }
      double numbers[2][kRows];
      std::memcpy(numbers, sum, sizeof numbers);
      const long count = std::min<long>(kRows, rows - at);
      std::copy_n(numbers[0], count, product + at);
      if (squares != nullptr) std::copy_n(numbers[1], count, squares + at);
    }
  }

  using Block = Vector[kLanes];
  static constexpr auto kAll = std::make_integer_sequence<int, kLanes>{};

  /// Swaps elements (i, j + kBit) and (i + kBit, j) of a block where neither i nor j has that bit;
  /// kIndex are 0, 1, ... kLanes - 1.
  template <int kBit, int... kIndex>
  [[gnu::always_inline]] static void Exchange(Block& a,
                                              std::integer_sequence<int, kIndex...> /*all*/) {
#pragma GCC unroll 8
    for (int i = 0; i < kLanes; ++i) {
      if ((i & kBit) != 0) continue;
      const Vector first = a[i], second = a[i + kBit];
      a[i] = __builtin_shufflevector(first, second,
                                     ((kIndex & kBit) != 0 ? kIndex - kBit + kLanes : kIndex)...);
      a[i + kBit] = __builtin_shufflevector(
          first, second, ((kIndex & kBit) != 0 ? kIndex + kLanes : kIndex + kBit)...);
    }
  }

  [[gnu::always_inline]] static void Transpose(Block& a) {
    Exchange<1>(a, kAll);
    if constexpr (kLanes > 2) Exchange<2>(a, kAll);
    if constexpr (kLanes > 4) Exchange<4>(a, kAll);
  }

  /// to(i, j) = from(j, i), i, j < kLanes, i < count, both by columns.
  [[gnu::always_inline]] static void Transpose(long count, const double* from, long ld, double* to,
                                               long ldt) {
    Block a;
#pragma GCC unroll 8
    for (int j = 0; j < kLanes; ++j) a[j] = Load(from + j * ld);
    Transpose(a);
#pragma GCC unroll 8
    for (int i = 0; i < kLanes; ++i) {
      if (i < count) Store(to + i * ldt, a[i]);
    }
  }

  /// Elements kFirst, kFirst + 1, ... of the first vector, those before of the other.
  template <int kFirst, int... kIndex>
  [[gnu::always_inline]] static Vector FromPlace(const Vector& from, const Vector& before,
                                                 std::integer_sequence<int, kIndex...> /*all*/) {
    return __builtin_shufflevector(from, before, (kIndex < kFirst ? kIndex + kLanes : kIndex)...);
  }

  /// A block on the diagonal of a symmetric matrix, of its lower triangle; kIndex as above.
  template <int... kIndex>
  [[gnu::always_inline]] static void TakeOwn(const double* from, long ld, double* to,
                                             std::integer_sequence<int, kIndex...> all) {
    Block lower, upper;
    ((upper[kIndex] = lower[kIndex] = Load(from + kIndex * ld)), ...);
    Transpose(upper);
    (Store(to + kIndex * kRows, FromPlace<kIndex>(lower[kIndex], upper[kIndex], all)), ...);
  }

  /// Rows and columns [at, at + count), kRows at most, of the symmetric P; zeros below.
  [[gnu::always_inline]] static void TakeDiagonal(const double* p, long ld, long at, long count,
                                                  double* panel) {
    const double* const from = p + at + at * ld;
    double* const to = panel + at * kRows;
    if (count < kRows) {
      for (long c = 0; c < count; ++c) {
        for (long r = 0; r < c; ++r) to[r + c * kRows] = from[c + r * ld];
        for (long r = c; r < count; ++r) to[r + c * kRows] = from[r + c * ld];
        for (long r = count; r < kRows; ++r) to[r + c * kRows] = 0.0;
      }
      return;
    }
#pragma GCC unroll 8
    for (int b = 0; b < kRows; b += kLanes) {
      TakeOwn(from + b + b * ld, ld, to + b + b * kRows, kAll);
#pragma GCC unroll 8
      for (int r = b + kLanes; r < kRows; r += kLanes) {
#pragma GCC unroll 8
        for (int c = b; c < b + kLanes; ++c) Store(to + r + c * kRows, Load(from + r + c * ld));
        Transpose(kLanes, from + r + b * ld, ld, to + b + r * kRows, kRows);
      }
    }
  }

  /// Columns [first, last) of rows [at, at + kRows) of the symmetric P, n x n, at their place in
  /// `panel`; zeros below its last row.
  [[gnu::always_inline]] static void TakeRows(const double* p, long ld, long n, long at, long first,
                                              long last, double* panel) {
    const long count = std::min<long>(kRows, n - at), end = at + count;
    for (long c = first; c < std::min(last, at); ++c) {
      const double* const from = p + at + c * ld;
      double* const to = panel + c * kRows;
      if (count == kRows) {
#pragma GCC unroll 8
        for (int v = 0; v < kVectors; ++v) Store(to + v * kLanes, Load(from + v * kLanes));
      } else {
        for (long r = 0; r < kRows; ++r) to[r] = r < count ? from[r] : 0.0;
      }
    }
    if (first < end && last > at) TakeDiagonal(p, ld, at, count, panel);
    for (long c = std::max(first, end); c < last; c += kLanes) {
      if (c + kLanes <= n) {
#pragma GCC unroll 8
        for (int v = 0; v < kVectors; ++v) {
          Transpose(last - c, p + c + (at + v * kLanes) * ld, ld, panel + c * kRows + v * kLanes,
                    kRows);
        }
        continue;
      }
      for (long k = c; k < last; ++k) {
        for (long r = 0; r < kRows; ++r) panel[r + k * kRows] = p[k + (at + r) * ld];
      }
    }
  }

  /// The same of columns [first, last) of A', A in panels, m its columns.
  [[gnu::always_inline]] static void TakeColumns(const double* panels, long m, long at, long first,
                                                 long last, double* panel) {
    const long count = std::min<long>(kRows, m - at);
    for (long i = first / kLanes * kLanes; i < last; i += kLanes) {
      const double* const from = panels + i / kRows * kRows * m + at * kRows + i % kRows;
      double* const to = panel + i * kRows;
#pragma GCC unroll 8
      for (int v = 0; v < kVectors; ++v) {
        if ((v + 1) * kLanes <= count) {
          Transpose(kLanes, from + v * kLanes * kRows, kRows, to + v * kLanes, kRows);
          continue;
        }
        for (long r = v * kLanes; r < (v + 1) * kLanes; ++r) {
          for (int k = 0; k < kLanes; ++k)
            to[r + k * kRows] = r < count ? from[r * kRows + k] : 0.0;
        }
      }
    }
  }

  /// `v`, in a register: the compiler would load it for each row again, and P H' waits for its
  /// loads (a quarter of its time).
  [[gnu::always_inline]] static Vector Held(Vector v) {
#if defined(__x86_64__) && !defined(__clang__)
    asm("" : "+v"(v));
#endif
    return v;
  }

  /// kCount columns of Y = X H', of those rows of H from `row` on; X is a panel.
  template <int kCount>
  [[gnu::always_inline]] static void MultiplyRows(const JacobianRows& h, long row, const double* x,
                                                  double* y, long ldy) {
    const double* const own = h.data + row * h.stride;
    Vector sum[kCount][kVectors] = {};
    for (const JacobianPart& part : h.parts) {
      const double* from = x + static_cast<long>(part.offset) * kRows;
      const double* j = own + part.column;
      for (int c = 0; c < part.size; ++c, from += kRows, ++j) {
        Vector column[kVectors];
#pragma GCC unroll 8
        for (int v = 0; v < kVectors; ++v) column[v] = Held(Load(from + v * kLanes));
#pragma GCC unroll 8
        for (int r = 0; r < kCount; ++r) {
#pragma GCC unroll 8
          for (int v = 0; v < kVectors; ++v) sum[r][v] += column[v] * j[r * h.stride];
        }
      }
    }
#pragma GCC unroll 8
    for (int r = 0; r < kCount; ++r) {
#pragma GCC unroll 8
      for (int v = 0; v < kVectors; ++v) Store(y + r * ldy + v * kLanes, sum[r][v]);
    }
  }

  /// All columns of Y = X H'.
  [[gnu::always_inline]] static void MultiplyByRows(const JacobianRows& h, const double* x,
                                                    double* y, long ldy) {
    long row = 0;
    for (; row + 4 <= h.rows; row += 4) MultiplyRows<4>(h, row, x, y + row * ldy, ldy);
    if (h.rows - row == 3) MultiplyRows<3>(h, row, x, y + row * ldy, ldy);
    if (h.rows - row == 2) MultiplyRows<2>(h, row, x, y + row * ldy, ldy);
    if (h.rows - row == 1) MultiplyRows<1>(h, row, x, y + row * ldy, ldy);
  }

  [[gnu::always_inline]] static void Project(const double* p, long ld, long n,
                                             std::span<const JacobianRows> rows, double* pht,
                                             long row_step, long ldpht) {
    const std::span<const Run> runs = RunsOf(rows, n);
    long m = 0;
    for (const JacobianRows& h : rows) m += h.rows;
    double* const x = packed_left.Take((n + kRows) * kRows);
    double* const last = packed_right.Take(m * kRows);
    for (long at = 0; at < n; at += kRows) {
      for (const Run& run : runs) TakeRows(p, ld, n, at, run.first, run.last, x);
      // A matrix has no room for what a last panel has below the last row.
      const bool fits = at + kRows <= n || ldpht == kRows;
      const long ldy = fits ? ldpht : kRows;
      double* y = fits ? pht + at * row_step : last;
      for (const JacobianRows& h : rows) {
        MultiplyByRows(h, x, y, ldy);
        y += h.rows * ldy;
      }
      for (long k = 0; !fits && k < m; ++k) {
        std::copy_n(last + k * kRows, n - at, pht + at * row_step + k * ldpht);
      }
    }
  }

  [[gnu::always_inline]] static void AddProjected(long n, std::span<const JacobianRows> rows,
                                                  const double* panels, double* s, long lds) {
    const std::span<const Run> runs = RunsOf(rows, n);
    long m = 0, most = 0;
    for (const JacobianRows& h : rows) {
      m += h.rows;
      most = std::max<long>(most, h.rows);
    }
    double* const x = packed_left.Take((n + kRows) * kRows);
    double* const y = packed_right.Take(most * kRows);
    for (long at = 0; at < m; at += kRows) {
      for (const Run& run : runs) TakeColumns(panels, m, at, run.first, run.last, x);
      const long end = std::min<long>(at + kRows, m);
      long k = 0;
      for (const JacobianRows& h : rows) {
        if (k >= end) break;  // to the right of the diagonal
        MultiplyByRows(h, x, y, kRows);
        for (long c = 0; c < h.rows; ++c, ++k) {
          for (long i = std::max(at, k); i < end; ++i) s[i + k * lds] += y[c * kRows + i - at];
        }
      }
    }
  }

  /// The compiler would keep what is stored in registers for whoever loads it next, so many that it
  /// has none left for the loop before (a quarter of the time of a factorisation).
  [[gnu::always_inline]] static void EmptyRegisters() {
#if defined(__x86_64__)
    asm volatile("" ::: "memory");
#endif
  }

  /// L of A = L L', kColumns square; of A the lower triangle is read. False where a pivot is not
  /// finite and positive.
  [[gnu::always_inline]] static bool FactoriseOwn(const double* a, long lda, double* l) {
    constexpr int kHeight = kColumns / kLanes;
    Vector x[kColumns][kHeight];
#pragma GCC unroll 8
    for (int c = 0; c < kColumns; ++c) {
#pragma GCC unroll 8
      for (int v = 0; v < kHeight; ++v) x[c][v] = Load(a + c * lda + v * kLanes);
    }
#pragma GCC unroll 8
    for (int j = 0; j < kColumns; ++j) {
      const double pivot = x[j][j / kLanes][j % kLanes];
      if (!(pivot > 0.0 && pivot <= std::numeric_limits<double>::max())) return false;
      const double root = std::sqrt(pivot), reciprocal = 1.0 / root;
#pragma GCC unroll 8
      for (int v = 0; v < kHeight; ++v) x[j][v] *= reciprocal;
      x[j][j / kLanes][j % kLanes] = root;
#pragma GCC unroll 8
      for (int v = 0; v < kHeight; ++v) Store(l + j * kColumns + v * kLanes, x[j][v]);
#pragma GCC unroll 8
      for (int c = j + 1; c < kColumns; ++c) {
        const double factor = x[j][c / kLanes][c % kLanes];
#pragma GCC unroll 8
        for (int v = 0; v < kHeight; ++v) x[c][v] -= x[j][v] * factor;
      }
    }
    return true;
  }

  [[gnu::always_inline]] static bool Factorise(long m, double* s, long lds) {
    double* const panel = packed_left.Take(kRows * (m + kRows));
    for (long at = 0; at < m; at += kRows) {
      const long high = std::min<long>(kRows, m - at), end = at + high;
      PackLeft(high, end, s + at, {nullptr, 1, lds}, panel);
      for (long j = end; j < at + kRows; ++j) {  // what is missing of the last panel: I
        std::fill_n(panel + j * kRows, kRows, 0.0);
        panel[j - at + j * kRows] = 1.0;
      }
      DividePanels(high, at, s, lds, panel);
      for (long j = at; j < end; j += kColumns) {
        // Of its own columns the panel has the rows of L itself.
        double* const own = panel + j * kRows;
        SubtractColumns<kVectors, kColumns>(0, j, panel + j - at, kRows, panel, own);
        EmptyRegisters();
        double l[kColumns * kColumns];
        if (!FactoriseOwn(own + j - at, kRows, l)) return false;
        DivideColumns<kVectors, kColumns>(l, kColumns, own);
      }
      for (long k = 0; k < end; ++k) {
        const long i = std::max(k - at, 0L);
        std::memcpy(s + at + i + k * lds, panel + i + k * kRows,
                    static_cast<std::size_t>(high - i) * sizeof(double));
      }
    }
    return true;
  }

  template <int kCount>
  [[gnu::always_inline]] static void CombineColumns(long rows, long k, const double* x, long ldx,
                                                    const double* j, long ldj, double* y,
                                                    long ldy) {
    long i = 0;
    for (; i + kLanes <= rows; i += kLanes) {
      Vector sum[kCount];
#pragma GCC unroll 8
      for (int c = 0; c < kCount; ++c) sum[c] = Load(y + i + c * ldy);
      for (long p = 0; p < k; ++p) {
        const Vector v = Load(x + i + p * ldx);
#pragma GCC unroll 8
        for (int c = 0; c < kCount; ++c) sum[c] += v * j[c * ldj + p];
      }
#pragma GCC unroll 8
      for (int c = 0; c < kCount; ++c) Store(y + i + c * ldy, sum[c]);
    }
    for (; i < rows; ++i) {
      for (int c = 0; c < kCount; ++c) {
        double sum = y[i + c * ldy];
        for (long p = 0; p < k; ++p) sum += x[i + p * ldx] * j[c * ldj + p];
        y[i + c * ldy] = sum;
      }
    }
  }

  [[gnu::always_inline]] static void Combine(long rows, long k, long m, const double* x, long ldx,
                                             const double* j, long ldj, double* y, long ldy) {
    long c = 0;
    for (; c + 4 <= m; c += 4)
      CombineColumns<4>(rows, k, x, ldx, j + c * ldj, ldj, y + c * ldy, ldy);
    for (; c + 2 <= m; c += 2)
      CombineColumns<2>(rows, k, x, ldx, j + c * ldj, ldj, y + c * ldy, ldy);
    if (c < m) CombineColumns<1>(rows, k, x, ldx, j + c * ldj, ldj, y + c * ldy, ldy);
  }
};

/// The loops, compiled for one instruction set; `target` is an attribute, or nothing.
#define ALIDADE_KERNELS(kernels, loops, shown_name, target)                                        \
  struct kernels {                                                                                 \
    target static void AddProduct(long rows, long columns, long depth, const Strided& a,           \
                                  const Strided& b, double* c, long ldc, double sign,              \
                                  bool lower) {                                                    \
      loops::AddProduct(rows, columns, depth, a, b, c, ldc, sign, lower);                          \
    }                                                                                              \
    target static void DivideByTransposed(long rows, long m, const double* l, long ldl, double* b, \
                                          long ldb) {                                              \
      loops::DivideByTransposed(rows, m, l, ldl, b, ldb);                                          \
    }                                                                                              \
    target static void Combine(long rows, long k, long m, const double* x, long ldx,               \
                               const double* j, long ldj, double* y, long ldy) {                   \
      loops::Combine(rows, k, m, x, ldx, j, ldj, y, ldy);                                          \
    }                                                                                              \
    target static void DividePanels(long rows, long m, const double* l, long ldl,                  \
                                    double* panels) {                                              \
      loops::DividePanels(rows, m, l, ldl, panels);                                                \
    }                                                                                              \
    target static void SubtractOuterProduct(long rows, long m, const double* panels, double* c,    \
                                            long ldc) {                                            \
      loops::SubtractOuterProduct(rows, m, panels, c, ldc);                                        \
    }                                                                                              \
    target static void MultiplyPanels(long rows, long m, const double* panels, const double* x,    \
                                      double* product, double* squares) {                          \
      loops::MultiplyPanels(rows, m, panels, x, product, squares);                                 \
    }                                                                                              \
    target static bool Factorise(long m, double* s, long lds) {                                    \
      return loops::Factorise(m, s, lds);                                                          \
    }                                                                                              \
    target static void Project(const double* p, long ld, long n,                                   \
                               std::span<const JacobianRows> rows, double* pht, long row_step,     \
                               long ldpht) {                                                       \
      loops::Project(p, ld, n, rows, pht, row_step, ldpht);                                        \
    }                                                                                              \
    target static void AddProjected(long n, std::span<const JacobianRows> rows,                    \
                                    const double* panels, double* s, long lds) {                   \
      loops::AddProjected(n, rows, panels, s, lds);                                                \
    }                                                                                              \
    static constexpr VectorKernels kTable{shown_name,         AddProduct,                          \
                                          DivideByTransposed, Combine,                             \
                                          Factorise,          loops::kRows,                        \
                                          DividePanels,       SubtractOuterProduct,                \
                                          MultiplyPanels,     Project,                             \
                                          AddProjected};                                           \
  }

using BaselineLoops = Loops<2, 2, 4>;
ALIDADE_KERNELS(Baseline, BaselineLoops, "baseline", );
#if defined(__x86_64__)
using Avx2Loops = Loops<4, 3, 4>;
using Avx512Loops = Loops<8, 3, 8>;
ALIDADE_KERNELS(Avx2, Avx2Loops, "AVX2", [[gnu::target("avx2,fma")]]);
ALIDADE_KERNELS(Avx512, Avx512Loops, "AVX-512", [[gnu::target("avx512f,avx2,fma")]]);
#endif
#undef ALIDADE_KERNELS

std::vector<VectorKernels> FindKernels() {
  std::vector<VectorKernels> found = {Baseline::kTable};
#if defined(__x86_64__)
  __builtin_cpu_init();
  const bool avx2 = __builtin_cpu_supports("avx2") != 0 && __builtin_cpu_supports("fma") != 0;
  if (avx2) found.push_back(Avx2::kTable);
  if (avx2 && __builtin_cpu_supports("avx512f") != 0) found.push_back(Avx512::kTable);
#endif
  return found;
}

}  // namespace

std::span<const VectorKernels> AllVectorKernels() {
  static const std::vector<VectorKernels> all = FindKernels();
  return all;
}

const VectorKernels& BestVectorKernels() {
  static const VectorKernels& best = []() -> const VectorKernels& {
    const std::span<const VectorKernels> all = AllVectorKernels();
    const char* const asked = std::getenv("ALIDADE_KERNELS");
    if (asked == nullptr || *asked == '\0') return all.back();
    std::string names;
    for (const VectorKernels& kernels : all) {
      if (std::string_view(asked) == kernels.name) return kernels;
      names.append(names.empty() ? "" : ", ").append(kernels.name);
    }
    throw Error(ExitCode::kUsage, "environment variable ALIDADE_KERNELS: '" + std::string(asked) +
                                      "' is none of the kernels of this processor: " + names);
  }();
  return best;
}

}  // namespace alidade::internal
