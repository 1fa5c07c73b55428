// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/state/instruction_set.h"

/// The inner loops of large products and factors, once for each instruction set: this build asks
/// for none, the processor it runs on is asked at run time. The sets differ by rounding alone.
namespace alidade::internal {

/// A matrix that is read: element (i, j) at data[i * row_step + j * column_step].
struct Strided {
  const double* data;
  long row_step, column_step;
};

struct VectorKernels {
  /// C <- C + sign A B, C rows x columns, by columns with leading dimension ldc, A rows x depth;
  /// `lower`: of C the lower triangle alone. C overlaps neither A nor B.
  void (*add_product)(long rows, long columns, long depth, const Strided& a, const Strided& b,
                      double* c, long ldc, double sign, bool lower);
  /// B <- B L^-T, B rows x m, L m x m lower triangular, both by columns.
  void (*divide_by_transposed)(long rows, long m, const double* l, long ldl, double* b, long ldb);
  /// Puts L of a symmetric S = L L', m x m by columns, in place of its lower triangle; false unless
  /// that is finite and positive definite.
  bool (*factorise)(long m, double* s, long lds);
};

const VectorKernels& VectorKernelsOf(InstructionSet set);
/// Those of BestInstructionSet().
const VectorKernels& BestVectorKernels();

}  // namespace alidade::internal
