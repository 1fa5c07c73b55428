// SPDX-License-Identifier: Apache-2.0
#include "alidade/state/dense_algebra.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

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

double SquareRootOf(const Eigen::Ref<const Eigen::MatrixXd>& p, Eigen::LDLT<Eigen::MatrixXd>& ldlt,
                    Eigen::MatrixXd& root) {
  root.resize(p.rows(), p.cols());
  if (p.size() == 0) return 0.0;
  ldlt.compute(p);
  const auto d = ldlt.vectorD();
  root = ldlt.matrixL();
  for (Eigen::Index i = 0; i < d.size(); ++i) root.col(i) *= std::sqrt(std::max(d[i], 0.0));
  root = ldlt.transpositionsP().transpose() * root;
  const double smallest = d.minCoeff(), largest = p.diagonal().maxCoeff();
  if (!(smallest < 0.0)) return 0.0;
  return largest > 0.0 ? smallest / largest : -1.0;
}

double SquaredMahalanobis(const Eigen::MatrixXd& p, const Eigen::VectorXd& error) {
  constexpr double kSingular = 1e-13;
  const Eigen::VectorXd sigma = p.diagonal().cwiseSqrt();
  if (!p.allFinite() || !error.allFinite() || !(sigma.minCoeff() > 0.0)) return std::nan("");
  const Eigen::VectorXd scale = sigma.cwiseInverse();
  Eigen::LDLT<Eigen::MatrixXd> ldlt;
  ldlt.compute(Eigen::MatrixXd(scale.asDiagonal() * p * scale.asDiagonal()));
  if (ldlt.info() != Eigen::Success || !(ldlt.vectorD().minCoeff() > kSingular))
    return std::nan("");
  const Eigen::VectorXd scaled = scale.cwiseProduct(error);
  const double squared = scaled.dot(ldlt.solve(scaled));
  return std::isfinite(squared) ? squared : std::nan("");
}

double LogDeterminant(std::span<const double> p, int n) {
  constexpr double kNotANumber = std::numeric_limits<double>::quiet_NaN();
  if (n <= 0 || std::ssize(p) != std::ptrdiff_t{n} * n) return kNotANumber;
  if (n == 1) return p[0] > 0.0 ? std::log(p[0]) : kNotANumber;
  const Eigen::LLT<Eigen::MatrixXd> llt(Eigen::Map<const Eigen::MatrixXd>(p.data(), n, n));
  if (llt.info() != Eigen::Success) return kNotANumber;
  return 2.0 * llt.matrixLLT().diagonal().array().log().sum();
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
  LeastSquares solution{UpperTriangle(qr), {}, b};
  solution.q_adjoint_b.applyOnTheLeft(qr.householderQ().adjoint());
  solution.x = solution.r.triangularView<Eigen::Upper>().solve(solution.q_adjoint_b.head(a.cols()));
  return solution;
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
