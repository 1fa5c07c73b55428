// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <span>

#include "alidade/state/covariance.h"
#include "alidade/state/kernels.h"

namespace alidade::internal {

/// The equations of a Kalman update of n states by m rows, in memory that is kept from one update
/// to the next:
///
///   Begin        room for P H'
///   ComputeNis   of each measurement i:  P H_i',  S_i = H_i P H_i' + R_i,  r_i' S_i^-1 r_i
///   Solve        of those that passed, stacked:
///                S = H P H' + R = L D L',  W = P H' L^-T,  dx = W D^-1 L^-1 r,  K = W D^-1 L^-1
///   Downdate     P' = P - W D^-1 W'
///
/// The kernels for the size of P have the loops (kernels.h).
class KalmanUpdate {
 public:
  /// Starts an update of P by at most `capacity` rows; P has to stay in its memory.
  void Begin(Covariance& p, int capacity);
  /// Computes P H' of a measurement, in its columns, and its S. Returns its NIS, which is not a
  /// number unless S is finite and positive definite.
  double ComputeNis(const MeasurementRows& measurement) {
    return Kernels::For(kernels_->nis, measurement.h.rows)(update_, measurement);
  }
  /// Moves P H' of a measurement to columns before those it has.
  void MoveColumns(int from, int to, int count);
  /// L, D, W, dx and, if wanted, K of the update by `measurements`, whose columns follow one
  /// another.
  Solution Solve(std::span<const MeasurementRows* const> measurements, bool wants_gain);
  /// P - W D^-1 W' in place of P.
  void Downdate() { Kernels::For(kernels_->downdate, update_.m)(update_); }

  int rows() const { return update_.m; }  ///< m of Solve
  double* dx() { return update_.dx; }
  /// L^-1 r.
  std::span<const double> y() const { return {update_.y, static_cast<std::size_t>(update_.m)}; }
  /// K, if it was wanted.
  double& gain(int i, int j) const { return update_.At(update_.gain, i, j); }
  /// Elements of K, if it was wanted: of some rows in `count` columns, by columns.
  void CopyGain(std::span<const int> rows, int column, int count, double* to) const {
    if (update_.p.size > update_.panel_rows) return CopyGainOfPanels(rows, column, count, to);
    for (int j = column; j < column + count; ++j) {
      for (const int i : rows) *to++ = update_.gain[j * update_.panel_rows + i];
    }
  }
  /// Columns of P H' before Solve, of W after it: n x their number.
  void CopyColumns(int column, Eigen::Ref<Eigen::MatrixXd> to) const;
  double w(int i, int j) const { return update_.At(update_.w, i, j); }
  /// L sqrt(D) in the lower triangle of an m x m matrix: S = L D L' = l l'.
  void CopyFactor(Eigen::Ref<Eigen::MatrixXd> l) const;

 private:
  void Allocate();
  void CopyGainOfPanels(std::span<const int> rows, int column, int count, double* to) const;

  const Kernels* kernels_ = nullptr;
  Update update_{};
  double* gain_ = nullptr;
  AlignedNumbers memory_;
};

}  // namespace alidade::internal
