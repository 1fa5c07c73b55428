// SPDX-License-Identifier: Apache-2.0
#include "alidade/state/vector_kernels.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <new>
#include <utility>

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
};

/// The loops, compiled for one instruction set; `target` is an attribute, or nothing.
#define ALIDADE_KERNELS(kernels, loops, target)                                                    \
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
    target static bool Factorise(long m, double* s, long lds) {                                    \
      return loops::Factorise(m, s, lds);                                                          \
    }                                                                                              \
    static constexpr VectorKernels kTable{AddProduct, DivideByTransposed, Factorise};              \
  }

using BaselineLoops = Loops<2, 2, 4>;
ALIDADE_KERNELS(Baseline, BaselineLoops, );
#if defined(__x86_64__)
using Avx2Loops = Loops<4, 3, 4>;
using Avx512Loops = Loops<8, 3, 8>;
ALIDADE_KERNELS(Avx2, Avx2Loops, [[gnu::target("avx2,fma")]]);
ALIDADE_KERNELS(Avx512, Avx512Loops, [[gnu::target("avx512f,avx2,fma")]]);
#endif
#undef ALIDADE_KERNELS

}  // namespace

const VectorKernels& VectorKernelsOf([[maybe_unused]] InstructionSet set) {
#if defined(__x86_64__)
  if (set == InstructionSet::kAvx512) return Avx512::kTable;
  if (set == InstructionSet::kAvx2) return Avx2::kTable;
#endif
  return Baseline::kTable;
}

const VectorKernels& BestVectorKernels() {
  static const VectorKernels& best = VectorKernelsOf(BestInstructionSet());
  return best;
}

}  // namespace alidade::internal
