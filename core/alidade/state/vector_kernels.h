// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

/// The inner loops of large products and factors, once for each instruction set: this build asks
/// for none, the processor it runs on is asked at run time. The sets differ by rounding alone.
namespace alidade::internal {

/// A matrix that is read: element (i, j) at data[i * row_step + j * column_step].
struct Strided {
  const double* data;
  long row_step, column_step;
};

struct VectorKernels {
  const char* name;  ///< `baseline`, `AVX2`, `AVX-512`

  /// C <- C + sign A B, C rows x columns, by columns with leading dimension ldc, A rows x depth;
  /// `lower`: of C the lower triangle alone. C overlaps neither A nor B.
  void (*add_product)(long rows, long columns, long depth, const Strided& a, const Strided& b,
                      double* c, long ldc, double sign, bool lower);
  /// B <- B L^-T, B rows x m, L m x m lower triangular, both by columns.
  void (*divide_by_transposed)(long rows, long m, const double* l, long ldl, double* b, long ldb);
  /// Y <- Y + X J' of few columns: X rows x k by columns, J m x k by rows, Y rows x m.
  void (*combine)(long rows, long k, long m, const double* x, long ldx, const double* j, long ldj,
                  double* y, long ldy);
};

constexpr int kMostTransposed = 8;
/// to(j, i) = from(i, j) of at most kMostTransposed rows, both by columns.
void CopyTransposed(int rows, long columns, const double* from, long ld, double* to, long ldt);

/// Those that this processor runs, the fastest last.
std::span<const VectorKernels> AllVectorKernels();
/// The fastest, or those that the environment variable ALIDADE_KERNELS names. Error kUsage where it
/// names none of them.
const VectorKernels& BestVectorKernels();

}  // namespace alidade::internal
