// SPDX-License-Identifier: Apache-2.0
#include "alidade/state/vector_kernels.h"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <new>
#include <string>
#include <string_view>
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
      data_.reset(static_cast<double*>(
          ::operator new(static_cast<std::size_t>(size) * sizeof(double), kLine)));
      size_ = size;
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

  /// sum += A B of a panel of A, kRows rows, and one of B, kColumns columns.
  [[gnu::always_inline]] static void Multiply(long depth, const double* a, const double* b,
                                              Tile& sum) {
    for (long k = 0; k < depth; ++k, a += kRows, b += kColumns) {
      Vector left[kVectors];
#pragma GCC unroll 8
      for (int v = 0; v < kVectors; ++v) left[v] = Load(a + v * kLanes);
#pragma GCC unroll 8
      for (int c = 0; c < kColumns; ++c) {
#pragma GCC unroll 8
        for (int v = 0; v < kVectors; ++v) sum[c][v] += left[v] * b[c];
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
        for (long r = 0; r < count; ++r) to[r] = from[r * steps.row_step];
        for (long r = count; r < kRows; ++r) to[r] = 0.0;
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
              Multiply(deep, left + p * deep, right + q * deep, sum);
              AddTile(sum, std::min<long>(kRows, high - p), std::min<long>(kColumns, wide - q),
                      !lower || shift >= kColumns - 1, shift, c + i + p + (j + q) * ldc, ldc);
            }
          }
        }
      }
    }
  }

  /// Columns [j, j + kCount) of kRows rows, b, of B L^-T, those before being done.
  template <int kCount>
  [[gnu::always_inline]] static void SolveColumns(long j, const double* l, long ldl, double* b) {
    Vector x[kCount][kVectors];
#pragma GCC unroll 8
    for (int c = 0; c < kCount; ++c) {
#pragma GCC unroll 8
      for (int v = 0; v < kVectors; ++v) x[c][v] = Load(b + (j + c) * kRows + v * kLanes);
    }
    for (long k = 0; k < j; ++k) {
      Vector done[kVectors];
#pragma GCC unroll 8
      for (int v = 0; v < kVectors; ++v) done[v] = Load(b + k * kRows + v * kLanes);
#pragma GCC unroll 8
      for (int c = 0; c < kCount; ++c) {
#pragma GCC unroll 8
        for (int v = 0; v < kVectors; ++v) x[c][v] -= done[v] * l[j + c + k * ldl];
      }
    }
#pragma GCC unroll 8
    for (int c = 0; c < kCount; ++c) {
#pragma GCC unroll 8
      for (int d = 0; d < c; ++d) {
#pragma GCC unroll 8
        for (int v = 0; v < kVectors; ++v) x[c][v] -= x[d][v] * l[j + c + (j + d) * ldl];
      }
      const double reciprocal = 1.0 / l[j + c + (j + c) * ldl];
#pragma GCC unroll 8
      for (int v = 0; v < kVectors; ++v) {
        x[c][v] *= reciprocal;
        Store(b + (j + c) * kRows + v * kLanes, x[c][v]);
      }
    }
  }

  [[gnu::always_inline]] static void DivideByTransposed(long rows, long m, const double* l,
                                                        long ldl, double* b, long ldb) {
    for (long first = 0; first < m; first += kDepth) {
      const long count = std::min(kDepth, m - first);
      double* const to = b + first * ldb;
      if (first > 0) {
        AddProduct(rows, count, first, {b, 1, ldb}, {l + first, ldl, 1}, to, ldb, -1.0, false);
      }
      const double* const own = l + first + first * ldl;
      double* const panel = packed_left.Take(kRows * count);
      for (long i = 0; i < rows; i += kRows) {
        PackLeft(std::min<long>(kRows, rows - i), count, to + i, {nullptr, 1, ldb}, panel);
        long j = 0;
        for (; j + kColumns <= count; j += kColumns) SolveColumns<kColumns>(j, own, ldl, panel);
        for (; j < count; ++j) SolveColumns<1>(j, own, ldl, panel);
        const auto bytes =
            static_cast<std::size_t>(std::min<long>(kRows, rows - i)) * sizeof(double);
        for (j = 0; j < count; ++j) std::memcpy(to + i + j * ldb, panel + j * kRows, bytes);
      }
    }
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

/// The three loops, compiled for one instruction set; `target` is an attribute, or nothing.
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
    static constexpr VectorKernels kTable{shown_name, AddProduct, DivideByTransposed, Combine};    \
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

template <int kRowsOfAll>
void CopyTransposedRows(long columns, const double* from, long ld, double* to, long ldt) {
  for (long j = 0; j < columns; ++j) {
#pragma GCC unroll 8
    for (int i = 0; i < kRowsOfAll; ++i) to[j + i * ldt] = from[i + j * ld];
  }
}

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

void CopyTransposed(int rows, long columns, const double* from, long ld, double* to, long ldt) {
  static_assert(kMostTransposed == 8);
  constexpr decltype(&CopyTransposedRows<1>) kCopies[] = {
      CopyTransposedRows<1>, CopyTransposedRows<2>, CopyTransposedRows<3>, CopyTransposedRows<4>,
      CopyTransposedRows<5>, CopyTransposedRows<6>, CopyTransposedRows<7>, CopyTransposedRows<8>};
  if (rows > 0) kCopies[rows - 1](columns, from, ld, to, ldt);
}

std::span<const VectorKernels> AllVectorKernels() {
  static const std::vector<VectorKernels> all = FindKernels();
  return all;
}

const VectorKernels& BestVectorKernels() {
  static const VectorKernels& best = []() -> const VectorKernels& {
    const std::span<const VectorKernels> all = AllVectorKernels();
    const char* const asked = std::getenv("ALIDADE_KERNELS");
    if (asked == nullptr) return all.back();
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
