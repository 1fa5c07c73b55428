// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include "alidade/state/jacobian_rows.h"

/// Products and decompositions of dense matrices outside of inner loops, compiled once: Eigen
/// instantiates each combination of operands anew, which takes most of the time of a build.
namespace alidade::internal {

Eigen::MatrixXd Product(const ConstMatrix& a, const ConstMatrix& b);            ///< A B
Eigen::MatrixXd ProductTransposed(const ConstMatrix& a, const ConstMatrix& b);  ///< A B'
Eigen::MatrixXd TransposedProduct(const ConstMatrix& a, const ConstMatrix& b);  ///< A' B
Eigen::MatrixXd Congruence(const ConstMatrix& a, const ConstMatrix& p);         ///< A P A'

/// X with A X = B, A square and regular.
Eigen::MatrixXd SolveSquare(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);
/// X with A X = B, A symmetric and positive definite.
Eigen::MatrixXd SolvePositive(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);
/// The X of least norm with |A X - B| least, A of any shape and rank.
Eigen::MatrixXd SolveLeastNorm(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);

/// A square root A of a symmetric, positive semi-definite P = A A', singular or not, from the
/// pivoted L D L' of its lower triangle. Returns the most negative pivot, over the largest
/// variance; 0: none. Negative pivots count as zero. `ldlt` is memory.
double SquareRootOf(const Eigen::Ref<const Eigen::MatrixXd>& p, Eigen::LDLT<Eigen::MatrixXd>& ldlt,
                    Eigen::MatrixXd& root);

/// e' P^-1 e; NaN if P is singular, indefinite or not finite. P is scaled to unit variances first,
/// so that singular means the same in any unit.
double SquaredMahalanobis(const Eigen::MatrixXd& p, const Eigen::VectorXd& error);

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
/// The rank of A: pivots below `threshold` times the largest count as zero.
int RankOf(const Eigen::MatrixXd& a, double threshold);

}  // namespace alidade::internal
