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

/// View of a symmetric matrix that another object stores. Only the lower triangle is used.
using LowerTriangle = Eigen::Map<Eigen::MatrixXd, 0, Eigen::OuterStride<>>;
using ConstLowerTriangle = Eigen::Map<const Eigen::MatrixXd, 0, Eigen::OuterStride<>>;

/// Covariance P of a state in its tangent space. A block of rows is addressed by its offset and
/// size. P is one dense symmetric matrix, of which only the lower triangle is valid. Its memory has
/// spare capacity and consists of whole cache lines. lower() and view() return P without a copy.
/// Offsets and sizes must belong to rows that Add created; they are not checked. If the capacity is
/// sufficient, only functions that return a matrix allocate memory. The functions in projection.h
/// compute P H' and H P H'.
class Covariance {
 public:
  /// Returns the number of rows in use, including gaps. A gap has zero rows and columns.
  int size() const { return size_; }

  /// Adds `rows` > 0 rows and columns of zeros. Returns their offset. Uses the smallest gap that is
  /// large enough. If no gap is large enough, appends the rows. Amortised O(n).
  int Add(int rows);
  /// Provides memory for `rows` further rows. If the capacity is not sufficient, allocates memory
  /// for 9/8 of the required size, or for twice the capacity if this is larger. Add calls Reserve.
  void Reserve(int rows);
  /// Releases the rows [offset, offset + rows). O(n).
  void Release(int offset, int rows);
  /// Moves rows into the smallest gap that is large enough, and releases their old position.
  /// Returns their new offset. Returns -1 and changes nothing if no gap is large enough. O(n).
  int MoveToGap(int offset, int rows);

  /// Returns a copy of P(a, b), rows x columns. [a, a + rows) and [b, b + columns) are either the
  /// same rows or disjoint.
  Eigen::MatrixXd Block(int a, int rows, int b, int columns) const;
  /// Sets P(a, b) = `value` and P(b, a) = `value`', with the same condition on the rows as Block().
  /// Uses only the lower triangle of a diagonal block.
  void SetBlock(int a, int b, const ConstMatrix& value);
  /// Returns P(i, i), 0 <= i < size().
  double Variance(int i) const { return p()(i, i); }
  /// Sets the rows and columns [offset, offset + k). Their diagonal block becomes `diagonal_block`
  /// (k x k). All other elements become zero.
  void SetRows(int offset, const ConstMatrix& diagonal_block);
  /// Sets the k rows `rows` and the columns with the same indices. The elements in these rows and
  /// columns become `diagonal_block` (k x k). All other elements become those of `cross` (n x k, n
  /// = size()).
  void SetRows(std::span<const int> rows, const ConstMatrix& diagonal_block,
               const ConstMatrix& cross);

  /// Propagates k rows by x' = F x + N v, v ~ N(0, I), C = Cov(F x, N v):
  /// P_aa <- F P_aa F' + N N' + C + C',  P_ai <- F P_ai. F is k x k, N is k x width and C is k x k,
  /// all row-major. A null pointer means zero. O(n k). Returns false and changes nothing if a
  /// variance would not be finite.
  bool Propagate(std::span<const int> rows, const double* f, const double* noise = nullptr,
                 int width = 0, const double* cross = nullptr);

  /// Returns a view of P, without a copy.
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
  std::vector<std::pair<int, int>> gaps_;  ///< offset and number of rows of each gap
  Scratch<Workspace> memory_;
  Scratch<AlignedNumbers> step_memory_;
  Scratch<std::vector<int>> moved_rows_;
};

}  // namespace alidade
