// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

/// Decompositions of dense matrices that are not in an inner loop. Eigen's are compiled here alone,
/// once: they are among what costs most to instantiate.
namespace alidade::internal {

/// A = V diag(l) V', the eigenvalues l in increasing order.
struct SymmetricEigen {
  Eigen::VectorXd values;
  Eigen::MatrixXd vectors;  ///< columns
};

/// Of a symmetric matrix, whose lower triangle is read.
SymmetricEigen EigenOf(const Eigen::MatrixXd& symmetric);
Eigen::VectorXd EigenvaluesOf(const Eigen::MatrixXd& symmetric);

/// The least |A x - b|, A = Q R of m x n, m >= n, and full rank.
struct LeastSquares {
  Eigen::MatrixXd r;            ///< n x n, upper triangular
  Eigen::VectorXd x;            ///< n
  Eigen::VectorXd q_adjoint_b;  ///< Q' b, m
};
LeastSquares SolveLeastSquares(const Eigen::MatrixXd& a, const Eigen::VectorXd& b);

/// R of A = Q R, n x n, A m x n, m >= n.
Eigen::MatrixXd UpperTriangleOf(const Eigen::MatrixXd& a);
/// Orthonormal columns that are orthogonal to those of A, m x n of full rank: m x (m - n).
Eigen::MatrixXd ComplementOf(const Eigen::MatrixXd& a);

/// x with |A x - b| least, A of any rank, by pivoting columns.
Eigen::VectorXd SolveByPivoting(const Eigen::MatrixXd& a, const Eigen::VectorXd& b);
/// The rank of A, where pivots below `threshold` times the largest count as zero.
int RankOf(const Eigen::MatrixXd& a, double threshold);

}  // namespace alidade::internal
