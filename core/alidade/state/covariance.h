// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <span>
#include <utility>
#include <vector>

#include "alidade/base/eigen_alignment.h"
#include "alidade/base/workspace.h"
#include "alidade/state/panels.h"

namespace alidade {

/// Matrices as they cross the plugin ABI.
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// The columns of a Jacobian that belong to one block of the state: at `column` of its rows.
struct JacobianPart {
  int offset;  ///< of the block in the covariance
  int size;
  int column;
};

/// m rows of a Jacobian H, row-major in the caller's memory, that is zero but for its parts.
struct JacobianRows {
  const double* data;
  int rows;
  int stride;  ///< numbers in a row
  std::span<const JacobianPart> parts;
  bool whole = false;  ///< rows are as wide as the covariance, zeros included
};

/// The covariance P of a state in its tangent, behind block queries: who uses it names rows by
/// (offset, size). Dense: one symmetric matrix, the lower triangle authoritative, with spare
/// capacity; what corrects all of it takes it from where it lies. Offsets and sizes lie in
/// [0, size()], as Add gave them; they are not checked, but where said.
/// Nothing allocates memory in the steady state but what returns a matrix.
///
/// With what lies outside of it, b, the state is correlated by Cov(x, b) = Phi C, C (k x |b|)
/// somewhere else: the rows of Phi (n x k) go along with what the rows of P go through. k = 0
/// where nothing lies outside. Rows that nothing but updates has changed are *still*.
class Covariance {
 public:
  using ConstMatrix = Eigen::Ref<const Eigen::MatrixXd>;
  using Lower = Eigen::Map<Eigen::MatrixXd, 0, Eigen::OuterStride<>>;
  using ConstLower = Eigen::Map<const Eigen::MatrixXd, 0, Eigen::OuterStride<>>;
  using Factor = Eigen::Map<Eigen::MatrixXd, 0, Eigen::OuterStride<>>;

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
  double Variance(int i) const { return p_(i, i); }
  /// Sets rows [offset, offset + k): `own` (k x k) on the diagonal, zero elsewhere, in Phi too.
  void SetRows(int offset, const ConstMatrix& own);
  /// Sets the rows of all `parts`, of k columns together: `own` (k x k) among them, `cross` (n x k,
  /// n = size()) elsewhere. Phi stays.
  void SetParts(std::span<const JacobianPart> parts, const ConstMatrix& own,
                const ConstMatrix& cross);

  /// pht = P H' (n x m, by columns) and s += H P H' (m x m). O(n m k), k the columns of H's parts.
  void Project(const JacobianRows& h, double* pht, double* s) const;
  /// pht = P H' of all rows, one after the other: n x m, m in all.
  void Project(std::span<const JacobianRows> rows, const internal::Panels& pht) const;
  /// s += H P H' alone (m x m). O(m k^2).
  void AddProjection(const JacobianRows& h, double* s) const;

  /// x' = F x + w of the k rows in `parts`, w ~ N(0, Q): P_aa <- F P_aa F' + Q, P_ai <- F P_ai,
  /// F and Q k x k, row-major, of Q the lower triangle; null: zero. O(n k). Phi_a <- F Phi_a.
  void Propagate(std::span<const JacobianPart> parts, const double* f, const double* q);

  /// P where it lies; the lower triangle counts.
  Lower lower() { return {p_.data(), size_, size_, Eigen::OuterStride<>(p_.rows())}; }
  ConstLower lower() const { return {p_.data(), size_, size_, Eigen::OuterStride<>(p_.rows())}; }
  /// The whole matrix, mirrored.
  Eigen::MatrixXd Dense() const;

  /// Gives all rows back; the memory is kept.
  void Clear();
  /// k of Phi.
  int outside() const { return outside_; }
  /// k grows by `columns`, of zeros.
  void GrowOutside(int columns);
  /// Whether a row is still, since SetStill.
  bool still(int row) const { return still_[static_cast<std::size_t>(row)] != 0; }
  void SetStill(int offset, int rows) { std::fill_n(still_.begin() + offset, rows, char{1}); }
  /// Sets the rows of all `parts` of Phi: `phi` is Phi', k x their columns together.
  void SetOutside(std::span<const JacobianPart> parts, const ConstMatrix& phi);
  /// Phi', k x n.
  Factor phi() {
    return {phi_.data(), outside_, size_, Eigen::OuterStride<>(std::max<long>(phi_.rows(), 1))};
  }
  /// (H Phi)' by columns, k x m.
  void ProjectOutside(const JacobianRows& h, double* hphi) const;

 private:
  int TakeGap(int rows);
  void SetRows(int offset, const ConstMatrix& own, const ConstMatrix& cross);
  void Clear(int offset, int rows);
  void PropagateOutside(std::span<const JacobianPart> parts, const double* f);

  Eigen::MatrixXd p_;  ///< capacity x capacity
  int size_ = 0;
  Eigen::MatrixXd phi_;  ///< Phi', with spare room in rows and columns; zero there
  int outside_ = 0;
  std::vector<char> still_;                ///< by row, where something lies outside
  std::vector<std::pair<int, int>> gaps_;  ///< (offset, rows)
  Scratch<Workspace> memory_;
};

}  // namespace alidade
