// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Cholesky>

namespace alidade::internal {

/// Cholesky factor of a symmetric matrix; false unless it is finite and positive definite.
/// (Eigen's own LLT reports success on NaN.)
inline bool Factorise(const Eigen::MatrixXd& s, Eigen::LLT<Eigen::MatrixXd>& llt) {
  if (!s.allFinite()) return false;
  llt.compute(s);
  return llt.info() == Eigen::Success && (llt.matrixLLT().diagonal().array() > 0.0).all();
}

}  // namespace alidade::internal
