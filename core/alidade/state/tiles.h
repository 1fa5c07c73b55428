// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <span>

#include "alidade/state/jacobian_rows.h"
#include "alidade/state/workspace.h"

/// Products and factors of matrices, computed by the vector kernels of the processor. Divide()
/// passes small tiles to Eigen, whose temporary memory is then on the stack. Therefore no memory is
/// allocated in the steady state.
namespace alidade::internal {

using MutableMatrix = Eigen::Ref<Eigen::MatrixXd>;

constexpr Eigen::Index kTile = 32;  // small enough that Eigen does only a small part of the work

/// Computes C <- C + sign A B. `sign` is 1 or -1.
void AddProduct(MutableMatrix c, const ConstMatrix& a, const ConstMatrix& b, double sign = 1.0);
/// Computes C <- C + sign A B'. `sign` is 1 or -1.
void AddProductWithTransposed(MutableMatrix c, const ConstMatrix& a, const ConstMatrix& b,
                              double sign = 1.0);
/// Computes the lower triangle of C <- C + sign A A'. `sign` is 1 or -1.
void AddOuterProduct(MutableMatrix c, const ConstMatrix& a, double sign);
/// Computes the lower triangle of C <- C + sign A B'. A B' must be symmetric.
void AddSymmetricProduct(MutableMatrix c, const ConstMatrix& a, const ConstMatrix& b, double sign);
/// Computes the lower triangle of C_ab <- C_ab + A A'. C_ab consists of the rows and columns `rows`
/// of C. Row i of A corresponds to row rows[i] of C.
void AddOuterProduct(MutableMatrix c, std::span<const int> rows, const ConstMatrix& a);
/// Computes B <- B L^-T. L is the lower triangle of `l`.
void DivideByTransposed(const ConstMatrix& l, MutableMatrix b);
/// Computes B <- B L^-1. L is the lower triangle of `l`.
void Divide(const ConstMatrix& l, MutableMatrix b);
/// Computes P <- (I - K H) P (I - K H)' + K R K' for any gain K (Joseph form). Uses only the lower
/// triangle of P. K is n x m, H is m x n, R is m x m. O(n^2 m). Returns false and leaves P
/// unchanged if a variance would be negative.
bool Joseph(MutableMatrix p, const ConstMatrix& k, const ConstMatrix& h, const ConstMatrix& r,
            Workspace& work);
/// Replaces the lower triangle of a symmetric S = L L' by L. Returns false unless S is finite and
/// positive definite. (Eigen's LLT reports success for NaN.)
bool Factorise(MutableMatrix s);

}  // namespace alidade::internal
