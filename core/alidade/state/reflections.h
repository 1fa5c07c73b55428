// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/state/kernels.h"
#include "alidade/state/workspace.h"

/// Householder reflections, which multiply a matrix A by I - v v' from the right, with |v|^2 = 2.
/// They are orthogonal, so they do not change A A'. A reflection changes the pivot column and the
/// columns of A from `first` on. v contains one element for each of them.
///
/// The vector kernels process 8 rows at once. A matrix therefore has PaddedSize(rows) rows. The
/// additional rows contain any numbers.
namespace alidade::internal {

/// Returns a matrix of zeros with PaddedSize(rows) rows.
inline Workspace::Matrix TakePadded(Workspace& work, Eigen::Index rows, Eigen::Index columns) {
  Workspace::Matrix matrix = work.Take(PaddedSize(static_cast<int>(rows)), columns);
  matrix.setZero();
  return matrix;
}

/// Reflects the pivot column and the columns of A from `first` on. The pivot column may be outside
/// A.
void Reflect(Workspace::Matrix& a, double* pivot, Eigen::Index first, const double* v);
/// Makes the elements of row k zero from column `first` on. The pivot is the element (k, k). In the
/// changed columns, the rows above row k must be zero already. Writes v to `v`. If the elements of
/// row k are zero already, v is zero.
void EliminateRow(Workspace::Matrix& a, Eigen::Index k, Eigen::Index first, double* v);
/// Replaces A by [L 0], with L lower triangular. `reflectors` has one column for each row of A, and
/// one row for each column of A. Column k contains v of row k, from the diagonal on. If
/// `reflectors` has no columns, A is unchanged.
void Triangularise(Workspace::Matrix& a, Workspace::Matrix& reflectors);

}  // namespace alidade::internal
