// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

namespace alidade::internal {

/// A = V diag(l) V', the eigenvalues l in increasing order.
struct SymmetricEigen {
  Eigen::VectorXd values;
  Eigen::MatrixXd vectors;  ///< columns
};

/// Of a symmetric matrix, whose lower triangle is read. The solver is compiled here alone: it is
/// among what costs most to instantiate.
SymmetricEigen EigenOf(const Eigen::MatrixXd& symmetric);
Eigen::VectorXd EigenvaluesOf(const Eigen::MatrixXd& symmetric);

}  // namespace alidade::internal
