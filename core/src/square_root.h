// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/QR>

namespace alidade::internal {

/// A square root A of a symmetric, positive semi-definite P = A A', singular or not, from the
/// pivoted L D L'.
struct SquareRoot {
  Eigen::MatrixXd root;
  /// The most negative pivot, over the largest variance; 0: none. Negative pivots count as zero.
  double defect = 0.0;
};

inline SquareRoot SquareRootOf(const Eigen::MatrixXd& p) {
  SquareRoot result;
  if (p.size() == 0) return result;
  const Eigen::LDLT<Eigen::MatrixXd> ldlt(p);
  const Eigen::VectorXd d = ldlt.vectorD();
  const double largest = p.diagonal().maxCoeff();
  if (d.minCoeff() < 0.0) result.defect = largest > 0.0 ? d.minCoeff() / largest : -1.0;
  const Eigen::MatrixXd l = ldlt.matrixL();
  result.root = ldlt.transpositionsP().transpose() * (l * d.cwiseMax(0.0).cwiseSqrt().asDiagonal());
  return result;
}

/// Lower triangular L, n x n, with L L' = wide wide' for `wide` n x m.
inline Eigen::MatrixXd Triangular(const Eigen::MatrixXd& wide) {
  const Eigen::Index n = wide.rows(), k = std::min(n, wide.cols());
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(wide.transpose());
  Eigen::MatrixXd l = Eigen::MatrixXd::Zero(n, n);
  l.leftCols(k) = qr.matrixQR().topRows(k).triangularView<Eigen::Upper>().transpose();
  return l;
}

}  // namespace alidade::internal
