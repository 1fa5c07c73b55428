// SPDX-License-Identifier: Apache-2.0
#include "alidade/base/dense_algebra.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>

namespace alidade::internal {
namespace {

using Qr = Eigen::HouseholderQR<Eigen::MatrixXd>;

Eigen::MatrixXd UpperTriangle(const Qr& qr) {
  return qr.matrixQR().topRows(qr.cols()).triangularView<Eigen::Upper>();
}

}  // namespace

Eigen::MatrixXd Product(const ConstMatrix& a, const ConstMatrix& b) { return a * b; }

Eigen::MatrixXd ProductTransposed(const ConstMatrix& a, const ConstMatrix& b) {
  return a * b.transpose();
}

Eigen::MatrixXd TransposedProduct(const ConstMatrix& a, const ConstMatrix& b) {
  return a.transpose() * b;
}

Eigen::MatrixXd Congruence(const ConstMatrix& a, const ConstMatrix& p) {
  return ProductTransposed(Product(a, p), a);
}

Eigen::MatrixXd SolveSquare(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  return a.partialPivLu().solve(b);
}

Eigen::MatrixXd SolvePositive(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  return a.llt().solve(b);
}

Eigen::MatrixXd SolveLeastNorm(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  return a.completeOrthogonalDecomposition().solve(b);
}

SymmetricEigen EigenOf(const Eigen::MatrixXd& symmetric) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(symmetric);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

Eigen::VectorXd EigenvaluesOf(const Eigen::MatrixXd& symmetric) {
  return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(symmetric, Eigen::EigenvaluesOnly)
      .eigenvalues();
}

LeastSquares SolveLeastSquares(const Eigen::MatrixXd& a, const Eigen::VectorXd& b) {
  const Qr qr(a);
  LeastSquares found{UpperTriangle(qr), {}, b};
  found.q_adjoint_b.applyOnTheLeft(qr.householderQ().adjoint());
  found.x = found.r.triangularView<Eigen::Upper>().solve(found.q_adjoint_b.head(a.cols()));
  return found;
}

Eigen::MatrixXd UpperTriangleOf(const Eigen::MatrixXd& a) { return UpperTriangle(Qr(a)); }

Eigen::MatrixXd ComplementOf(const Eigen::MatrixXd& a) {
  const Eigen::MatrixXd q = Qr(a).householderQ();
  return q.rightCols(a.rows() - a.cols());
}

Eigen::VectorXd SolveByPivoting(const Eigen::MatrixXd& a, const Eigen::VectorXd& b) {
  return Eigen::ColPivHouseholderQR<Eigen::MatrixXd>(a).solve(b);
}

int RankOf(const Eigen::MatrixXd& a, double threshold) {
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(a);
  qr.setThreshold(threshold);
  return static_cast<int>(qr.rank());
}

}  // namespace alidade::internal
