// SPDX-License-Identifier: Apache-2.0
#include "alidade/state/vector_kernels.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <new>
#include <utility>

// g++ warns that the ABI for vector arguments differs. The warning does not apply, because only
// inlined functions have such arguments.
#pragma GCC diagnostic ignored "-Wpsabi"

namespace alidade::internal {
namespace {

/// Scratch memory that begins at a cache line. Later calls reuse the memory.
class Buffer {
 public:
  /// Returns memory for `size` uninitialised numbers. The memory is valid until the next call.
  double* Allocate(long size) {
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
  struct Deleter {
    void operator()(double* data) const { ::operator delete(data, kLine); }
  };
  std::unique_ptr<double, Deleter> data_;
  long size_ = 0;
};

thread_local Buffer packed_left, packed_right;

/// Loops over vectors of `kLanes` numbers. A product accumulates its sums in kVectors x kColumns
/// registers.
template <int kLanes, int kVectorsOfTile, int kColumnsOfTile>
struct Loops {
  using Vector [[gnu::vector_size(kLanes * sizeof(double))]] = double;
  static constexpr int kVectors = kVectorsOfTile, kColumns = kColumnsOfTile;
  static constexpr int kRows = kVectors * kLanes;
  using Tile = Vector[kColumns][kVectors];

  // A panel of the left factor fits into the L2 cache, a panel of the right factor into the L3
  // cache.
  static constexpr long kDepth = 256, kLeftRows = kRows * (192 / kRows), kRightColumns = 768;

  [[gnu::always_inline]] static Vector Load(const double* source) {
    Vector v;
    std::memcpy(&v, source, sizeof v);
    return v;
  }
  [[gnu::always_inline]] static void Store(double* destination, const Vector& v) {
    std::memcpy(destination, &v, sizeof v);
  }

  /// Computes sum += A B for the first kHeight vectors of a panel of A and kColumns columns of B.
  /// Adjacent rows of B are `step` numbers apart.
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

  /// Copies A to adjacent panels of kRows rows. Fills the last panel with zeros below the last row
  /// of A.
  [[gnu::always_inline]] static void PackLeft(long rows, long depth, const double* a,
                                              const Strided& steps, double* destination) {
    for (long i = 0; i < rows; i += kRows) {
      const long count = std::min<long>(kRows, rows - i);
      for (long k = 0; k < depth; ++k, destination += kRows) {
        const double* source = a + i * steps.row_step + k * steps.column_step;
        if (count == kRows && steps.row_step == 1) {
#pragma GCC unroll 8
          for (int v = 0; v < kVectors; ++v)
            Store(destination + v * kLanes, Load(source + v * kLanes));
          continue;
        }
        if (count < kRows) {
#pragma GCC unroll 8
          for (int v = 0; v < kVectors; ++v) Store(destination + v * kLanes, Vector{});
        }
        for (long r = 0; r < count; ++r) destination[r] = source[r * steps.row_step];
      }
    }
  }

  /// Copies sign B to adjacent panels of kColumns columns. Fills the last panel with zeros to the
  /// right of the last column of B.
  [[gnu::always_inline]] static void PackRight(long columns, long depth, const double* b,
                                               const Strided& steps, double sign,
                                               double* destination) {
    for (long j = 0; j < columns; j += kColumns) {
      const long count = std::min<long>(kColumns, columns - j);
      for (long k = 0; k < depth; ++k, destination += kColumns) {
        const double* source = b + k * steps.row_step + j * steps.column_step;
        if (count == kColumns && steps.column_step == 1) {
#pragma GCC unroll 8
          for (int c = 0; c < kColumns; c += kLanes)
            Store(destination + c, sign * Load(source + c));
          continue;
        }
        for (long c = 0; c < count; ++c) destination[c] = sign * source[c * steps.column_step];
        for (long c = count; c < kColumns; ++c) destination[c] = 0.0;
      }
    }
  }

  /// Computes C += sum for the `rows` and `columns` of a tile that lie inside C. If `is_whole` is
  /// false, changes only elements on or below the diagonal of C. The diagonal crosses the tile's
  /// first column `shift` rows above the tile's first row.
  [[gnu::always_inline]] static void AddTile(const Tile& sum, long rows, long columns,
                                             bool is_whole, long shift, double* c, long ldc) {
    if (is_whole && rows == kRows && columns == kColumns) {
#pragma GCC unroll 8
      for (int j = 0; j < kColumns; ++j) {
#pragma GCC unroll 8
        for (int v = 0; v < kVectors; ++v) {
          double* const destination = c + j * ldc + v * kLanes;
          Store(destination, Load(destination) + sum[j][v]);
        }
      }
      return;
    }
    double numbers[kColumns][kRows];
    std::memcpy(numbers, sum, sizeof numbers);
    for (long j = 0; j < columns; ++j) {
      for (long i = is_whole ? 0 : std::max(0L, j - shift); i < rows; ++i) {
        c[i + j * ldc] += numbers[j][i];
      }
    }
  }

  [[gnu::always_inline]] static void AddProduct(long rows, long columns, long depth,
                                                const Strided& a, const Strided& b, double* c,
                                                long ldc, double sign, bool lower_only) {
    const long width = std::min(depth, kDepth);
    double* const left = packed_left.Allocate((std::min(rows, kLeftRows) + kRows) * width);
    double* const right =
        packed_right.Allocate((std::min(columns, kRightColumns) + kColumns) * width);
    for (long j = 0; j < columns; j += kRightColumns) {
      const long panel_columns = std::min(kRightColumns, columns - j);
      for (long k = 0; k < depth; k += kDepth) {
        const long panel_depth = std::min(kDepth, depth - k);
        PackRight(panel_columns, panel_depth, b.data + k * b.row_step + j * b.column_step, b, sign,
                  right);
        for (long i = lower_only ? j : 0; i < rows; i += kLeftRows) {
          const long panel_rows = std::min(kLeftRows, rows - i);
          PackLeft(panel_rows, panel_depth, a.data + i * a.row_step + k * a.column_step, a, left);
          for (long q = 0; q < panel_columns; q += kColumns) {
            for (long p = 0; p < panel_rows; p += kRows) {
              // Number of rows by which the tile's corner lies below the diagonal of C.
              const long shift = i + p - (j + q);
              if (lower_only && shift + kRows <= 0) continue;
              Tile sum = {};
              Multiply(panel_depth, left + p * panel_depth, right + q * panel_depth, kColumns, sum);
              AddTile(sum, std::min<long>(kRows, panel_rows - p),
                      std::min<long>(kColumns, panel_columns - q),
                      !lower_only || shift >= kColumns - 1, shift, c + i + p + (j + q) * ldc, ldc);
            }
          }
        }
      }
    }
  }

  /// Subtracts a product from kCount columns `target` of a panel, in the first kHeight vectors of
  /// the panel. The factors are the columns [begin, end) of the panel and kCount rows of L, which
  /// begin at `l`.
  template <int kHeight, int kCount>
  [[gnu::always_inline]] static void SubtractColumns(long begin, long end, const double* l,
                                                     long ldl, const double* panel,
                                                     double* target) {
    Vector x[kCount][kHeight];
#pragma GCC unroll 8
    for (int c = 0; c < kCount; ++c) {
#pragma GCC unroll 8
      for (int v = 0; v < kHeight; ++v) x[c][v] = Load(target + c * kRows + v * kLanes);
    }
    for (long k = begin; k < end; ++k) {
      Vector solved[kHeight];
#pragma GCC unroll 8
      for (int v = 0; v < kHeight; ++v) solved[v] = Load(panel + k * kRows + v * kLanes);
#pragma GCC unroll 8
      for (int c = 0; c < kCount; ++c) {
#pragma GCC unroll 8
        for (int v = 0; v < kHeight; ++v) x[c][v] -= solved[v] * l[c + k * ldl];
      }
    }
#pragma GCC unroll 8
    for (int c = 0; c < kCount; ++c) {
#pragma GCC unroll 8
      for (int v = 0; v < kHeight; ++v) Store(target + c * kRows + v * kLanes, x[c][v]);
    }
  }

  /// Multiplies kCount columns `target` of a panel by L^-T of size kCount, in the first kHeight
  /// vectors of the panel.
  template <int kHeight, int kCount>
  [[gnu::always_inline]] static void DivideColumns(const double* l, long ldl, double* target) {
    Vector x[kCount][kHeight];
#pragma GCC unroll 8
    for (int c = 0; c < kCount; ++c) {
#pragma GCC unroll 8
      for (int v = 0; v < kHeight; ++v) x[c][v] = Load(target + c * kRows + v * kLanes);
#pragma GCC unroll 8
      for (int d = 0; d < c; ++d) {
#pragma GCC unroll 8
        for (int v = 0; v < kHeight; ++v) x[c][v] -= x[d][v] * l[c + d * ldl];
      }
      const double reciprocal = 1.0 / l[c + c * ldl];
#pragma GCC unroll 8
      for (int v = 0; v < kHeight; ++v) {
        x[c][v] *= reciprocal;
        Store(target + c * kRows + v * kLanes, x[c][v]);
      }
    }
  }

  template <int kHeight, int kCount>
  [[gnu::always_inline]] static void SolveColumns(long j, long k, bool is_last, const double* l,
                                                  long ldl, double* panel) {
    double* const target = panel + j * kRows;
    SubtractColumns<kHeight, kCount>(k, std::min(k + kDepth, j), l + j, ldl, panel, target);
    if (is_last) DivideColumns<kHeight, kCount>(l + j + j * ldl, ldl, target);
  }

  /// Applies columns [k, k + kDepth) of L to columns [first, first + count) of a panel of B L^-T,
  /// in the first kHeight vectors of the panel. The columns before `first` are already final.
  template <int kHeight>
  [[gnu::always_inline]] static void SolvePanel(long first, long count, long k, const double* l,
                                                long ldl, double* panel) {
    const bool is_last = k == first;
    long j = first;
    for (; j + kColumns <= first + count; j += kColumns) {
      SolveColumns<kHeight, kColumns>(j, k, is_last, l, ldl, panel);
    }
    if (j + 4 <= first + count) {
      SolveColumns<kHeight, 4>(j, k, is_last, l, ldl, panel);
      j += 4;
    }
    if (j + 2 <= first + count) {
      SolveColumns<kHeight, 2>(j, k, is_last, l, ldl, panel);
      j += 2;
    }
    if (j < first + count) SolveColumns<kHeight, 1>(j, k, is_last, l, ldl, panel);
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
    double* const panels = packed_left.Allocate((rows + kRows) * m);
    PackLeft(rows, m, b, {nullptr, 1, ldb}, panels);
    DividePanels(rows, m, l, ldl, panels);
    for (long i = 0; i < rows; i += kRows) {
      const auto bytes = static_cast<std::size_t>(std::min<long>(kRows, rows - i)) * sizeof(double);
      for (long j = 0; j < m; ++j) {
        std::memcpy(b + i + j * ldb, panels + i * m + j * kRows, bytes);
      }
    }
  }

  /// Prevents the compiler from retaining stored values in registers for later loads. Otherwise the
  /// preceding loop would lack registers, which costs a quarter of the time of a factorisation.
  [[gnu::always_inline]] static void FlushRegisters() {
#if defined(__x86_64__)
    asm volatile("" ::: "memory");
#endif
  }

  /// Computes L of A = L L', kColumns x kColumns, from the lower triangle of A. Returns false if a
  /// pivot is not finite and positive.
  [[gnu::always_inline]] static bool FactoriseBlock(const double* a, long lda, double* l) {
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
    double* const panel = packed_left.Allocate(kRows * (m + kRows));
    for (long begin = 0; begin < m; begin += kRows) {
      const long rows = std::min<long>(kRows, m - begin), end = begin + rows;
      PackLeft(rows, end, s + begin, {nullptr, 1, lds}, panel);
      // Completes the last panel with rows of the identity.
      for (long j = end; j < begin + kRows; ++j) {
        std::fill_n(panel + j * kRows, kRows, 0.0);
        panel[j - begin + j * kRows] = 1.0;
      }
      DividePanels(rows, begin, s, lds, panel);
      for (long j = begin; j < end; j += kColumns) {
        // The panel contains the rows of L that correspond to these columns.
        double* const target = panel + j * kRows;
        SubtractColumns<kVectors, kColumns>(0, j, panel + j - begin, kRows, panel, target);
        FlushRegisters();
        double l[kColumns * kColumns];
        if (!FactoriseBlock(target + j - begin, kRows, l)) return false;
        DivideColumns<kVectors, kColumns>(l, kColumns, target);
      }
      for (long k = 0; k < end; ++k) {
        const long i = std::max(k - begin, 0L);
        std::memcpy(s + begin + i + k * lds, panel + i + k * kRows,
                    static_cast<std::size_t>(rows - i) * sizeof(double));
      }
    }
    return true;
  }

  [[gnu::always_inline]] static void Reflect(long rows, long columns, const double* v, double* p,
                                             double* a, long lda) {
    constexpr int kHeight = 8 / kLanes;
    for (long i = 0; i < rows; i += 8) {
      Vector sum[kHeight];
#pragma GCC unroll 8
      for (int h = 0; h < kHeight; ++h) sum[h] = v[0] * Load(p + i + h * kLanes);
      for (long j = 0; j < columns; ++j) {
#pragma GCC unroll 8
        for (int h = 0; h < kHeight; ++h) sum[h] += v[j + 1] * Load(a + i + j * lda + h * kLanes);
      }
#pragma GCC unroll 8
      for (int h = 0; h < kHeight; ++h) {
        double* const element = p + i + h * kLanes;
        Store(element, Load(element) - v[0] * sum[h]);
      }
      for (long j = 0; j < columns; ++j) {
#pragma GCC unroll 8
        for (int h = 0; h < kHeight; ++h) {
          double* const element = a + i + j * lda + h * kLanes;
          Store(element, Load(element) - v[j + 1] * sum[h]);
        }
      }
    }
  }
};

/// Defines the class `kernels`, which contains the loops compiled for one instruction set. `target`
/// is an attribute, or empty.
#define ALIDADE_KERNELS(kernels, loops, target)                                                    \
  struct kernels {                                                                                 \
    target static void AddProduct(long rows, long columns, long depth, const Strided& a,           \
                                  const Strided& b, double* c, long ldc, double sign,              \
                                  bool lower_only) {                                               \
      loops::AddProduct(rows, columns, depth, a, b, c, ldc, sign, lower_only);                     \
    }                                                                                              \
    target static void DivideByTransposed(long rows, long m, const double* l, long ldl, double* b, \
                                          long ldb) {                                              \
      loops::DivideByTransposed(rows, m, l, ldl, b, ldb);                                          \
    }                                                                                              \
    target static bool Factorise(long m, double* s, long lds) {                                    \
      return loops::Factorise(m, s, lds);                                                          \
    }                                                                                              \
    target static void Reflect(long rows, long columns, const double* v, double* p, double* a,     \
                               long lda) {                                                         \
      loops::Reflect(rows, columns, v, p, a, lda);                                                 \
    }                                                                                              \
    static constexpr VectorKernels kTable{AddProduct, DivideByTransposed, Factorise, Reflect};     \
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
