// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/state/instruction_set.h"

/// Inner loops of large products and factors, compiled for each instruction set. The program
/// selects the set at run time, according to the features of the processor. The results of the sets
/// differ only by rounding.
namespace alidade::internal {

/// Read-only matrix with element (i, j) at data[i * row_step + j * column_step].
struct Strided {
  const double* data;
  long row_step, column_step;
};

/// Kernels of one instruction set.
struct VectorKernels {
  /// Computes C <- C + sign A B. C is rows x columns, column-major with leading dimension ldc. A is
  /// rows x depth. If `lower_only` is true, only the lower triangle of C is computed. C must not
  /// overlap A or B.
  void (*add_product)(long rows, long columns, long depth, const Strided& a, const Strided& b,
                      double* c, long ldc, double sign, bool lower_only);
  /// Computes B <- B L^-T. B is rows x m. L is m x m and lower triangular. Both are column-major.
  void (*divide_by_transposed)(long rows, long m, const double* l, long ldl, double* b, long ldb);
  /// Replaces the lower triangle of a symmetric S = L L' by L. S is m x m and column-major. Returns
  /// false unless S is finite and positive definite.
  bool (*factorise)(long m, double* s, long lds);
  /// Computes [p A] <- [p A] (I - v v'). p is a column. A is rows x columns and column-major. v has
  /// columns + 1 elements. `rows` is a multiple of 8.
  void (*reflect)(long rows, long columns, const double* v, double* p, double* a, long lda);
};

/// Returns the kernels of an instruction set.
const VectorKernels& VectorKernelsOf(InstructionSet set);
/// Returns the kernels of BestInstructionSet().
const VectorKernels& BestVectorKernels();

}  // namespace alidade::internal
