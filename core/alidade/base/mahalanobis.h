// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <cmath>

namespace alidade::internal {

/// e' P^-1 e, not a number where P is singular, indefinite or not finite. P is scaled to unit
/// variances first, so that singular means the same in any unit.
inline double SquaredMahalanobis(const Eigen::MatrixXd& p, const Eigen::VectorXd& error) {
  constexpr double kSingular = 1e-13;
  const Eigen::VectorXd sigma = p.diagonal().cwiseSqrt();
  if (!p.allFinite() || !error.allFinite() || !(sigma.minCoeff() > 0.0)) return std::nan("");
  const Eigen::VectorXd scale = sigma.cwiseInverse();
  const Eigen::LDLT<Eigen::MatrixXd> ldlt(scale.asDiagonal() * p * scale.asDiagonal());
  if (ldlt.info() != Eigen::Success || !(ldlt.vectorD().minCoeff() > kSingular))
    return std::nan("");
  const Eigen::VectorXd scaled = scale.cwiseProduct(error);
  const double squared = scaled.dot(ldlt.solve(scaled));
  return std::isfinite(squared) ? squared : std::nan("");
}

}  // namespace alidade::internal
