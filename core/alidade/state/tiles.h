// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <span>

#include "alidade/state/jacobian_rows.h"
#include "alidade/state/workspace.h"

/// Products and factors of matrices by the vector kernels of the processor; what is left to Eigen
/// is in tiles that it works on the stack: nothing is allocated in the steady state.
namespace alidade::internal {

using MutableMatrix = Eigen::Ref<Eigen::MatrixXd>;

constexpr Eigen::Index kTile = 32;  // what the kernels leave to Eigen is small then

/// C <- C + sign A B, sign 1 or -1.
void AddProduct(MutableMatrix c, const ConstMatrix& a, const ConstMatrix& b, double sign = 1.0);
/// C <- C + sign A B', sign 1 or -1.
void AddProductWithTransposed(MutableMatrix c, const ConstMatrix& a, const ConstMatrix& b,
                              double sign = 1.0);
/// The lower triangle of C <- C + sign A A', sign 1 or -1.
void AddOuterProduct(MutableMatrix c, const ConstMatrix& a, double sign);
/// The lower triangle of C <- C + sign A B', where A B' is symmetric.
void AddSymmetricProduct(MutableMatrix c, const ConstMatrix& a, const ConstMatrix& b, double sign);
/// The lower triangle of C_ab <- C_ab + A A' of the given rows, which A has one after the other.
void AddOuterProduct(MutableMatrix c, std::span<const int> rows, const ConstMatrix& a);
/// B <- B L^-T, L the lower triangle of `l`.
void DivideByTransposed(const ConstMatrix& l, MutableMatrix b);
/// B <- B L^-1, L the lower triangle of `l`.
void Divide(const ConstMatrix& l, MutableMatrix b);
/// The lower triangle of P <- (I - K H) P (I - K H)' + K R K' for any gain K (Joseph), K n x m,
/// H m x n, R m x m, from that of P. O(n^2 m). False, and P as it was, where a variance would be
/// negative.
bool Joseph(MutableMatrix p, const ConstMatrix& k, const ConstMatrix& h, const ConstMatrix& r,
            Workspace& work);
/// Puts L of a symmetric S = L L' in place of its lower triangle; false unless S is finite and
/// positive definite. (Eigen's own LLT reports success on NaN.)
bool Factorise(MutableMatrix s);

}  // namespace alidade::internal
