// SPDX-License-Identifier: Apache-2.0
#include "alidade/state/projection.h"

#include <algorithm>

namespace alidade {

void Project(const Covariance& p, const JacobianRows& h, double* pht, double* s) {
  const ConstLowerTriangle lower = p.lower();
  const Eigen::Index n = p.size(), m = h.rows, width = h.width();
  const Eigen::Map<const RowMajor> rows(h.data, m, width);
  Eigen::Map<Eigen::MatrixXd> product(pht, n, m);
  product.setZero();
  for (Eigen::Index c = 0; c < width; ++c) {
    const Eigen::Index column = h.columns[static_cast<std::size_t>(c)], height = n - column;
    for (Eigen::Index i = 0; i < m; ++i) {
      product.col(i).head(column) += rows(i, c) * lower.row(column).head(column).transpose();
      product.col(i).tail(height) += rows(i, c) * lower.col(column).tail(height);
    }
  }
  for (Eigen::Index i = 0; i < m; ++i) {
    for (Eigen::Index k = 0; k < m; ++k) {
      double sum = 0.0;
      for (Eigen::Index c = 0; c < width; ++c) {
        sum += rows(i, c) * product(h.columns[static_cast<std::size_t>(c)], k);
      }
      s[i * m + k] += sum;
    }
  }
}

void AddProjection(const Covariance& p, const JacobianRows& h, double* s) {
  const ConstLowerTriangle lower = p.lower();
  const Eigen::Index m = h.rows, width = h.width();
  const Eigen::Map<const RowMajor> rows(h.data, m, width);
  for (Eigen::Index i = 0; i < m; ++i) {
    for (Eigen::Index c = 0; c < width; ++c) {
      double sum = 0.0;  // element of row i of H P
      for (Eigen::Index d = 0; d < width; ++d) {
        const auto [low, high] = std::minmax(h.columns[static_cast<std::size_t>(c)],
                                             h.columns[static_cast<std::size_t>(d)]);
        sum += rows(i, d) * lower(high, low);
      }
      for (Eigen::Index k = 0; k <= i; ++k) s[i * m + k] += sum * rows(k, c);
    }
    for (Eigen::Index k = 0; k < i; ++k) s[k * m + i] = s[i * m + k];
  }
}

}  // namespace alidade
