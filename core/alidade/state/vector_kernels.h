// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "alidade/state/jacobian_rows.h"
#include "alidade/state/panels.h"

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

  /// Puts L of a symmetric S = L L', m x m by columns, in place of its lower triangle; false unless
  /// that is finite and positive definite.
  bool (*factorise)(long m, double* s, long lds);

  long panel_rows;  ///< the height of the panels of what follows
  /// B <- B L^-T, B rows x m in panels.
  void (*divide_panels)(long rows, long m, const double* l, long ldl, double* panels);
  /// The lower triangle of C <- C - W W', W n x m in panels, C by columns.
  void (*subtract_outer_product)(long n, long m, const double* panels, double* c, long ldc);
  /// A x and, unless null, the squared norm of each row of A, n x m in panels.
  void (*multiply_panels)(long n, long m, const double* panels, const double* x, double* product,
                          double* squares);
  /// P H' (n x m) of all rows of H, of the lower triangle of P, n x n by columns. Its rows from a
  /// multiple `at` of panel_rows on begin at pht + at * row_step: panels have row_step = m and
  /// ldpht = panel_rows, a matrix 1 and n.
  void (*project)(const double* p, long ld, long n, std::span<const JacobianRows> rows, double* pht,
                  long row_step, long ldpht);
  /// The lower triangle of S <- S + H P H', m x m by columns, of P H' (n x m) in panels.
  void (*add_projected)(long n, std::span<const JacobianRows> rows, const double* panels, double* s,
                        long lds);
};

/// Those that this processor runs, the fastest last.
std::span<const VectorKernels> AllVectorKernels();
/// The fastest, or those that the environment variable ALIDADE_KERNELS names. Error kUsage where it
/// names none of them.
const VectorKernels& BestVectorKernels();

}  // namespace alidade::internal
