// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace alidade::internal {

/// A square root A of a symmetric, positive semi-definite P = A A', singular or not, from the
/// pivoted L D L' of its lower triangle. Returns the most negative pivot, over the largest
/// variance; 0: none. Negative pivots count as zero. `ldlt` is memory.
inline double SquareRootOf(const Eigen::Ref<const Eigen::MatrixXd>& p,
                           Eigen::LDLT<Eigen::MatrixXd>& ldlt, Eigen::MatrixXd& root) {
  root.resize(p.rows(), p.cols());
  if (p.size() == 0) return 0.0;
  ldlt.compute(p);
  const auto d = ldlt.vectorD();
  root = ldlt.matrixL();
  for (Eigen::Index i = 0; i < d.size(); ++i) root.col(i) *= std::sqrt(std::max(d[i], 0.0));
  root = ldlt.transpositionsP().transpose() * root;
  const double least = d.minCoeff(), largest = p.diagonal().maxCoeff();
  if (!(least < 0.0)) return 0.0;
  return largest > 0.0 ? least / largest : -1.0;
}

}  // namespace alidade::internal
