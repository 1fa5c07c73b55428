// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <span>
#include <utility>
#include <vector>

#include "alidade/base/eigen_alignment.h"
#include "alidade/base/workspace.h"

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
/// capacity; the fast path and square roots take it from where it lies. Offsets and sizes lie in
/// [0, size()], as Add gave them; they are not checked, but where said.
/// Nothing allocates memory in the steady state but what returns a matrix.
class Covariance {
 public:
  using ConstMatrix = Eigen::Ref<const Eigen::MatrixXd>;

  /// Rows in use, gaps included; a gap has zero rows and columns.
  int size() const { return size_; }

  /// Takes `rows` > 0 new rows, uncorrelated and zero, and returns their offset; a gap that holds
  /// them, the smallest, is used before the end. Amortised O(n).
  int Add(int rows);
  /// Gives [offset, offset + rows) back. O(n).
  void Release(int offset, int rows);
  /// Where the smallest gap of at least `rows` rows begins; -1: there is none.
  int FindGap(int rows) const;
  /// Moves rows to a released place (ContractViolation: not released) and releases where they were.
  /// O(n).
  void Move(int from, int to, int rows);

  /// P(a, b) as a copy, rows x columns. [a, a + rows) and [b, b + columns) are the same rows, or
  /// have none in common.
  Eigen::MatrixXd Block(int a, int rows, int b, int columns) const;
  /// Sets P(a, b) and P(b, a) = P(a, b)', as above; of a diagonal block the lower triangle counts.
  void SetBlock(int a, int b, const ConstMatrix& value);
  /// P(i, i), 0 <= i < size().
  double Variance(int i) const { return p_(i, i); }
  /// Sets rows [offset, offset + k): `own` (k x k) on the diagonal, `cross` (n x k, n = size())
  /// elsewhere; its rows [offset, offset + k) are not read.
  void SetRows(int offset, const ConstMatrix& own, const ConstMatrix& cross);
  /// The same, zero elsewhere.
  void SetRows(int offset, const ConstMatrix& own);
  /// Sets the rows of all `parts`, of k columns together: `own` (k x k) among them, `cross` (n x k)
  /// elsewhere.
  void SetParts(std::span<const JacobianPart> parts, const ConstMatrix& own,
                const ConstMatrix& cross);

  /// pht = P H' (n x m, by columns) and s += H P H' (m x m). O(n m k), k the columns of H's parts.
  void Project(const JacobianRows& h, double* pht, double* s) const;

  /// x' = F x + w of the k rows in `parts`, w ~ N(0, Q): P_aa <- F P_aa F' + Q, P_ai <- F P_ai,
  /// F and Q k x k, row-major, of Q the lower triangle. O(n k).
  void Propagate(std::span<const JacobianPart> parts, const double* f, const double* q);

  /// Few states, at least one: the operations below exist.
  bool small() const { return size_ > 0 && size_ <= kSmall; }
  static constexpr int kSmall = 16;
  /// Of m <= kSmall rows with P H' (by columns), S and innovation r: W = P H' L^-T and 1/D for
  /// S = L D L', dx = K r and K = P H' S^-1 (by columns). False where S is not positive definite.
  bool Solve(int m, const double* pht, const double* s, const double* r, double* w,
             double* inverse_d, double* dx, double* gain) const;
  /// P <- P - W D^-1 W', with what Solve gave. False, and P as it was, where a variance would lose
  /// nearly all its digits.
  bool Downdate(int m, const double* w, const double* inverse_d);
  /// P <- P - W W', W n x m. O(n^2 m).
  void SubtractOuter(const ConstMatrix& w);
  /// P_ab <- P_ab + E E' of the given rows, which E has one after the other.
  void AddOuter(std::span<const int> rows, const ConstMatrix& e);
  /// P <- (I - K H) P (I - K H)' + K R K' for any gain K (Joseph), K n x m, H m x n, R m x m.
  /// O(n^2 m). False, and P as it was, where a variance would not be >= 0.
  bool Joseph(const ConstMatrix& k, const ConstMatrix& h, const ConstMatrix& r);
  /// Rows of one block <- J (k x k, row-major) times them: P_bb <- J P_bb J', P_bi <- J P_bi.
  void Transform(int offset, int k, const double* j);
  /// Where P lies, column-major with leading dimension stride(); the lower triangle counts.
  double* data() { return p_.data(); }
  const double* data() const { return p_.data(); }
  int stride() const { return static_cast<int>(p_.rows()); }
  /// The whole matrix, mirrored.
  Eigen::MatrixXd Dense() const;

 private:
  void TakeFromGap(int offset, int rows);
  void Clear(int offset, int rows);

  Eigen::MatrixXd p_;  ///< capacity x capacity
  int size_ = 0;
  std::vector<std::pair<int, int>> gaps_;  ///< (offset, rows)
  Scratch<Workspace> memory_;
};

}  // namespace alidade
