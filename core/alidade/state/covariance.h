// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <span>
#include <utility>
#include <vector>

#include "alidade/state/eigen_alignment.h"
#include "alidade/state/jacobian_rows.h"
#include "alidade/state/workspace.h"

namespace alidade {

namespace internal {
struct SymmetricView;
}

/// View of a symmetric matrix in its memory. Only the lower triangle is used.
using LowerTriangle = Eigen::Map<Eigen::MatrixXd, 0, Eigen::OuterStride<>>;
using ConstLowerTriangle = Eigen::Map<const Eigen::MatrixXd, 0, Eigen::OuterStride<>>;

/// Covariance P of a state in its tangent. Blocks of rows are addressed by (offset, size). P is one
/// dense symmetric matrix whose lower triangle is valid, with spare capacity in whole cache lines.
/// lower() and view() provide P in its memory. Offsets and sizes come from Add, lie in [0, size()]
/// and are not checked. In the steady state only functions that return a matrix allocate memory.
/// projection.h computes P H' and H P H'.
class Covariance {
 public:
  /// Returns the number of rows in use, including gaps. A gap has zero rows and columns.
  int size() const { return size_; }

  /// Adds `rows` > 0 rows, uncorrelated and zero, and returns their offset. Uses the smallest gap
  /// that is large enough, or else the end. Amortised O(n).
  int Add(int rows);
  /// Allocates memory for `rows` further rows and an eighth more, or for twice the capacity if that
  /// is larger. Add calls it.
  void Reserve(int rows);
  /// Releases the rows [offset, offset + rows). O(n).
  void Release(int offset, int rows);
  /// Moves rows into the smallest gap that is large enough, releases their former place and returns
  /// their new offset. Returns -1 and changes nothing if no gap is large enough. O(n).
  int MoveToGap(int offset, int rows);

  /// Returns a copy of P(a, b), rows x columns. [a, a + rows) and [b, b + columns) are either the
  /// same rows or disjoint.
  Eigen::MatrixXd Block(int a, int rows, int b, int columns) const;
  /// Sets P(a, b) and P(b, a) = P(a, b)', with rows as in Block. Of a diagonal block only the lower
  /// triangle is used.
  void SetBlock(int a, int b, const ConstMatrix& value);
  /// Returns P(i, i), 0 <= i < size().
  double Variance(int i) const { return p()(i, i); }
  /// Sets rows [offset, offset + k): `diagonal_block` (k x k), and zero elsewhere.
  void SetRows(int offset, const ConstMatrix& diagonal_block);
  /// Sets k rows: `diagonal_block` (k x k) among them, `cross` (n x k, n = size()) elsewhere.
  void SetRows(std::span<const int> rows, const ConstMatrix& diagonal_block,
               const ConstMatrix& cross);

  /// Propagates k rows by x' = F x + N v, v ~ N(0, I), C = Cov(F x, N v):
  /// P_aa <- F P_aa F' + N N' + C + C',  P_ai <- F P_ai. Row-major: F k x k, N k x width, C k x k;
  /// null means zero. O(n k). Returns false and changes nothing if a variance would not be finite.
  bool Propagate(std::span<const int> rows, const double* f, const double* noise = nullptr,
                 int width = 0, const double* cross = nullptr);

  /// Returns views of P in its memory.
  LowerTriangle lower() { return {p_.data(), size_, size_, Eigen::OuterStride<>(capacity_)}; }
  ConstLowerTriangle lower() const {
    return {p_.data(), size_, size_, Eigen::OuterStride<>(capacity_)};
  }
  internal::SymmetricView view();
  /// Returns a copy of P with both triangles.
  Eigen::MatrixXd Dense() const;

 private:
  int UseGap(int rows);
  void Clear(int offset, int rows);
  Eigen::Map<Eigen::MatrixXd> p() { return {p_.data(), capacity_, capacity_}; }
  Eigen::Map<const Eigen::MatrixXd> p() const { return {p_.data(), capacity_, capacity_}; }

  AlignedNumbers p_;  ///< capacity x capacity; zero beyond size_
  int size_ = 0, capacity_ = 0;
  std::vector<std::pair<int, int>> gaps_;  ///< (offset, rows)
  Scratch<Workspace> memory_;
  Scratch<AlignedNumbers> step_memory_;
  Scratch<std::vector<int>> moved_rows_;
};

}  // namespace alidade
