// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Cholesky>

namespace alidade::internal {

/// Puts L of a symmetric S = L L' in place of its lower triangle; false unless S is finite and
/// positive definite. (Eigen's own LLT reports success on NaN.)
inline bool Factorise(Eigen::Ref<Eigen::MatrixXd> s) {
  if (!s.allFinite()) return false;
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> llt(s);
  return llt.info() == Eigen::Success && (s.diagonal().array() > 0.0).all();
}

}  // namespace alidade::internal
