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

/// A symmetric matrix where it lies: the lower triangle counts.
using LowerTriangle = Eigen::Map<Eigen::MatrixXd, 0, Eigen::OuterStride<>>;
using ConstLowerTriangle = Eigen::Map<const Eigen::MatrixXd, 0, Eigen::OuterStride<>>;

/// The covariance P of a state in its tangent, behind block queries: who uses it names rows by
/// (offset, size). Dense: one symmetric matrix, the lower triangle authoritative, with spare
/// capacity in whole cache lines; what corrects all of it takes it from where it lies. Offsets and
/// sizes lie in [0, size()], as Add gave them; they are not checked, but where said.
/// Nothing allocates memory in the steady state but what returns a matrix.
/// P H' and H P H' are made in projection.h.
class Covariance {
 public:
  /// Rows in use, gaps included; a gap has zero rows and columns.
  int size() const { return size_; }

  /// Takes `rows` > 0 new rows, uncorrelated and zero, and returns their offset; a gap that holds
  /// them, the smallest, is used before the end. Amortised O(n).
  int Add(int rows);
  /// Takes memory for `rows` more at once, and an eighth, or twice what there was. Add does so too.
  void Reserve(int rows);
  /// Gives [offset, offset + rows) back. O(n).
  void Release(int offset, int rows);
  /// Moves rows into the smallest gap that holds them, releases where they were, and returns their
  /// new offset; -1, and nothing has changed, where there is none. O(n).
  int MoveToGap(int from, int rows);

  /// P(a, b) as a copy, rows x columns. [a, a + rows) and [b, b + columns) are the same rows, or
  /// have none in common.
  Eigen::MatrixXd Block(int a, int rows, int b, int columns) const;
  /// Sets P(a, b) and P(b, a) = P(a, b)', as above; of a diagonal block the lower triangle counts.
  void SetBlock(int a, int b, const ConstMatrix& value);
  /// P(i, i), 0 <= i < size().
  double Variance(int i) const { return p()(i, i); }
  /// Sets rows [offset, offset + k): `own` (k x k) on the diagonal, zero elsewhere.
  void SetRows(int offset, const ConstMatrix& own);
  /// Sets k rows: `own` (k x k) among them, `cross` (n x k, n = size()) elsewhere.
  void SetRows(std::span<const int> rows, const ConstMatrix& own, const ConstMatrix& cross);

  /// x' = F x + N v of k rows, v ~ N(0, I), C = Cov(F x, N v): P_aa <- F P_aa F' + N N' + C + C',
  /// P_ai <- F P_ai. Row-major: F k x k, N k x width, C k x k; null: zero. O(n k). False, and
  /// nothing has changed, if a variance would not be finite.
  bool Propagate(std::span<const int> rows, const double* f, const double* noise = nullptr,
                 int width = 0, const double* cross = nullptr);

  /// P where it lies.
  LowerTriangle lower() { return {p_.data(), size_, size_, Eigen::OuterStride<>(capacity_)}; }
  ConstLowerTriangle lower() const {
    return {p_.data(), size_, size_, Eigen::OuterStride<>(capacity_)};
  }
  internal::SymmetricView view();
  /// The whole matrix, mirrored.
  Eigen::MatrixXd Dense() const;

 private:
  int TakeGap(int rows);
  void Clear(int offset, int rows);
  Eigen::Map<Eigen::MatrixXd> p() { return {p_.data(), capacity_, capacity_}; }
  Eigen::Map<const Eigen::MatrixXd> p() const { return {p_.data(), capacity_, capacity_}; }

  AlignedNumbers p_;  ///< capacity x capacity; zero beyond size_
  int size_ = 0, capacity_ = 0;
  std::vector<std::pair<int, int>> gaps_;  ///< (offset, rows)
  Scratch<Workspace> memory_;
  Scratch<AlignedNumbers> step_memory_;
  Scratch<std::vector<int>> moved_;  ///< rows
};

}  // namespace alidade
