// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <span>

#include "alidade/state/jacobian_rows.h"

/// Products and decompositions of dense matrices, for code outside inner loops. They are compiled
/// only once. Otherwise Eigen's templates would be compiled for each combination of operands, which
/// would dominate the build time.
namespace alidade::internal {

Eigen::MatrixXd Product(const ConstMatrix& a, const ConstMatrix& b);            ///< returns A B
Eigen::MatrixXd ProductTransposed(const ConstMatrix& a, const ConstMatrix& b);  ///< returns A B'
Eigen::MatrixXd TransposedProduct(const ConstMatrix& a, const ConstMatrix& b);  ///< returns A' B
Eigen::MatrixXd Congruence(const ConstMatrix& a, const ConstMatrix& p);         ///< returns A P A'

/// Returns X with A X = B; A is square and not singular.
Eigen::MatrixXd SolveSquare(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);
/// Returns X with A X = B; A is symmetric and positive definite.
Eigen::MatrixXd SolvePositive(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);
/// Returns the X of least norm that minimises |A X - B|; A may have any shape and rank.
Eigen::MatrixXd SolveLeastNorm(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);

/// Computes a square root A of a symmetric, positive semi-definite matrix P = A A', which may be
/// singular. Uses the pivoted factorisation L D L' of the lower triangle of P. Replaces negative
/// pivots by zero. Returns the most negative pivot divided by the largest variance, or 0 if no
/// pivot is negative. `ldlt` is scratch memory.
double SquareRootOf(const Eigen::Ref<const Eigen::MatrixXd>& p, Eigen::LDLT<Eigen::MatrixXd>& ldlt,
                    Eigen::MatrixXd& root);

/// Returns e' P^-1 e, or NaN if P is singular, indefinite or not finite. First scales P to unit
/// variances, so that the test for singularity does not depend on units.
double SquaredMahalanobis(const Eigen::MatrixXd& p, const Eigen::VectorXd& error);

/// Returns log det P of a symmetric, positive definite P, n x n, row-major; NaN if P is not
/// positive definite or has not n x n elements.
double LogDeterminant(std::span<const double> p, int n);

/// Eigenvalues l, in increasing order, and eigenvectors V of A = V diag(l) V'.
struct SymmetricEigen {
  Eigen::VectorXd values;
  Eigen::MatrixXd vectors;  ///< V, one eigenvector per column
};

/// Returns the eigenvalues and eigenvectors of a symmetric matrix. Only its lower triangle is read.
SymmetricEigen EigenOf(const Eigen::MatrixXd& symmetric);
Eigen::VectorXd EigenvaluesOf(const Eigen::MatrixXd& symmetric);

/// Least-squares solution x, which minimises |A x - b|. A = Q R is m x n, m >= n, and has full
/// rank.
struct LeastSquares {
  Eigen::MatrixXd r;            ///< R, n x n, upper triangular
  Eigen::VectorXd x;            ///< solution, n
  Eigen::VectorXd q_adjoint_b;  ///< Q' b, m
};
LeastSquares SolveLeastSquares(const Eigen::MatrixXd& a, const Eigen::VectorXd& b);

/// Returns the n x n matrix R of A = Q R. A is m x n, m >= n.
Eigen::MatrixXd UpperTriangleOf(const Eigen::MatrixXd& a);
/// Returns m - n orthonormal columns that are orthogonal to the columns of A. A is m x n and has
/// full rank.
Eigen::MatrixXd ComplementOf(const Eigen::MatrixXd& a);

/// Returns x that minimises |A x - b|, by QR with column pivoting. A may have any rank.
Eigen::VectorXd SolveByPivoting(const Eigen::MatrixXd& a, const Eigen::VectorXd& b);
/// Returns the rank of A. Pivots below `threshold` times the largest pivot count as zero.
int RankOf(const Eigen::MatrixXd& a, double threshold);

}  // namespace alidade::internal
