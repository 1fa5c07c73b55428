// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <span>

#include "alidade/state/covariance.h"
#include "alidade/state/kernels.h"

namespace alidade::internal {

/// Kalman update of n states by m rows of measurements. Later updates reuse the memory. An update
/// consists of these steps:
///
///   Begin        allocates P H'
///   ComputeNis   for each measurement i:  P H_i',  S_i = H_i P H_i' + R_i,  r_i' S_i^-1 r_i
///   Solve        for the accepted measurements, stacked:
///                S = H P H' + R = L D L',  W = P H' L^-T,  dx = W D^-1 L^-1 r,  K = W D^-1 L^-1
///   Downdate     P' = P - W D^-1 W'
///
/// kernels.h contains the loops, which are chosen according to the size of P.
class KalmanUpdate {
 public:
  /// Starts an update of P by at most `capacity` rows. The memory of P must not move until the
  /// update ends.
  void Begin(Covariance& p, int capacity);
  /// Computes S of a measurement, and P H' in the columns of the measurement. Returns the NIS, or
  /// NaN unless S is finite and positive definite.
  double ComputeNis(const MeasurementRows& measurement) {
    return Kernels::For(kernels_->nis, measurement.h.rows)(update_, measurement);
  }
  /// Moves P H' of a measurement from column `source` to `destination` < `source`.
  void MoveColumns(int source, int destination, int count);
  /// Computes L, D, W and dx of the update by `measurements`, whose columns must be adjacent. Also
  /// computes K if `needs_gain` is true.
  Solution Solve(std::span<const MeasurementRows* const> measurements, bool needs_gain);
  /// Replaces P by P - W D^-1 W'.
  void Downdate() { Kernels::For(kernels_->downdate, update_.m)(update_); }

  int rows() const { return update_.m; }  ///< number m of stacked rows in Solve()
  double* dx() { return update_.dx; }
  /// Returns L^-1 r.
  std::span<const double> y() const { return {update_.y, static_cast<std::size_t>(update_.m)}; }
  /// Returns K(i, j). Requires that `needs_gain` was true in Solve.
  double& gain(int i, int j) const { return update_.At(update_.gain, i, j); }
  /// Copies the rows `rows` of `count` columns of K, column by column. Requires that `needs_gain`
  /// was true in Solve.
  void CopyGain(std::span<const int> rows, int column, int count, double* destination) const {
    if (update_.p.size > update_.panel_rows)
      return CopyGainOfPanels(rows, column, count, destination);
    for (int j = column; j < column + count; ++j) {
      for (const int i : rows) *destination++ = update_.gain[j * update_.panel_rows + i];
    }
  }
  /// Copies columns of P H' to `destination`, which has n rows. After Solve(), copies columns of W
  /// instead.
  void CopyColumns(int column, Eigen::Ref<Eigen::MatrixXd> destination) const;
  /// Returns the reciprocals of the pivots D.
  const double* inverse_d() const { return update_.inverse_d; }
  double w(int i, int j) const { return update_.At(update_.w, i, j); }
  /// Copies l = L sqrt(D) to the lower triangle of an m x m matrix, so that S = L D L' = l l'.
  void CopyFactor(Eigen::Ref<Eigen::MatrixXd> l) const;

 private:
  void Allocate();
  void CopyGainOfPanels(std::span<const int> rows, int column, int count,
                        double* destination) const;

  const Kernels* kernels_ = nullptr;
  Update update_{};
  double* gain_ = nullptr;
  AlignedNumbers memory_;
};

}  // namespace alidade::internal
