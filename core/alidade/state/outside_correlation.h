// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <span>
#include <vector>

#include "alidade/state/jacobian_rows.h"
#include "alidade/state/workspace.h"

namespace alidade {

/// How a state is correlated with what lies outside of it, b: Cov(x, b) = Phi C, with C (k x |b|)
/// somewhere else; k = 0 where nothing lies outside. Covariance owns it, and does to the rows of
/// Phi (n x k) whatever it does to those of P. Rows that nothing but updates has changed since
/// SetStill are *still*.
class OutsideCorrelation {
 public:
  using Transposed = Eigen::Map<Eigen::MatrixXd, 0, Eigen::OuterStride<>>;

  /// k.
  int columns() const { return columns_; }
  /// k grows by `columns`, of zeros.
  void Grow(int columns);
  /// Phi', k x n.
  Transposed phi() {
    return {phi_.data(), columns_, rows_, Eigen::OuterStride<>(std::max<long>(phi_.rows(), 1))};
  }
  /// Sets the rows of all `parts` of Phi: `phi` is Phi', k x their columns together.
  void SetParts(std::span<const JacobianPart> parts, const ConstMatrix& phi);
  /// (H Phi)' by columns, k x m.
  void Project(const JacobianRows& h, double* hphi) const;
  /// False where k = 0.
  bool still(int row) const { return columns_ > 0 && still_[static_cast<std::size_t>(row)] != 0; }
  void SetStill(int offset, int rows) { std::fill_n(still_.begin() + offset, rows, char{1}); }

 private:
  friend class Covariance;
  void Resize(int rows);
  void Zero(int offset, int rows);
  void Copy(int from, int to, int rows);
  void Clear();
  /// Phi_a <- F Phi_a of the rows in `parts`, F as wide as these.
  void Propagate(const JacobianRows& f, Workspace& memory);

  Eigen::MatrixXd phi_;  ///< Phi', with spare room in rows and columns; zero there
  int columns_ = 0, rows_ = 0;
  std::vector<char> still_;  ///< by row, where something lies outside
};

}  // namespace alidade
