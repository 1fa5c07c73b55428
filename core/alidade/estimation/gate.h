// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "alidade/estimation/filter.h"
#include "alidade/estimation/pending_measurements.h"

namespace alidade::internal {

/// Chi-square gate: accepts a measurement if its NIS r' S^-1 r is at most the quantile of the
/// configured probability. Also computes the robust-loss weight, and counts consecutive rejections
/// by sensor. A copy is a snapshot.
class Gate {
 public:
  Gate(const Problem& problem, const EkfOptions& options);

  /// Tests a measurement by its NIS, and computes its robust weight w. Returns kAccepted, or the
  /// reason for a rejection. A measurement whose R / w is not finite is rejected.
  Outcome Test(FilterState& f, PendingMeasurement& pending, double nis) {
    return nis <= thresholds_[static_cast<std::size_t>(pending.sensor)] ? Pass(f, pending, nis)
                                                                        : Refuse(f, pending, nis);
  }
  /// R <- R / w, in R and in S, of measurements that passed.
  void ApplyRobustWeights(std::span<PendingMeasurement* const> rows) const;

  /// Counts the outcome of a measurement. Returns whether its sensor was rejected so often in a row
  /// that the filter has to recover; then the count starts again.
  bool Count(FilterState& f, const MeasurementReport& entry) {
    if (entry.outcome != Outcome::kAccepted && entry.outcome != Outcome::kInitialised) {
      return CountRejection(entry);
    }
    const auto sensor = static_cast<std::size_t>(entry.sensor);
    rejections_[sensor] = 0;
    f.health.out_of_domain[sensor] = f.health.inflated[sensor] = 0;
    return false;
  }

 private:
  Outcome Pass(FilterState& f, PendingMeasurement& pending, double nis) {
    CheckConditioning(f, pending);
    pending.report->nis = nis;
    pending.weight = 1.0;
    return pending.binding->loss.kind == LossKind::kNone ? Outcome::kAccepted : Weigh(pending, nis);
  }
  Outcome Refuse(FilterState& f, PendingMeasurement& pending, double nis);
  static Outcome Defect(FilterState& f, PendingMeasurement& pending);
  static Outcome Weigh(PendingMeasurement& pending, double nis);
  void CheckConditioning(FilterState& f, const PendingMeasurement& pending) {
    const auto m = static_cast<std::size_t>(pending.place->dof);
    for (std::size_t i = 0; i < m; ++i) {  // on the diagonals of R and S
      const std::size_t at = i * (m + 1);
      if (!(pending.R[at] > 1e-13 * pending.s[at])) return WarnOfConditioning(f, pending, at);
    }
  }
  void WarnOfConditioning(FilterState& f, const PendingMeasurement& pending, std::size_t i);
  bool CountRejection(const MeasurementReport& entry);

  bool gates_;                      ///< whether there is a gate: else what overflows passes too
  std::vector<double> thresholds_;  ///< on r' S^-1 r, by sensor; finite
  bool weighs_ = false;             ///< whether a sensor has a robust loss
  std::vector<bool> warned_;        ///< by sensor
  std::vector<int> rejections_;     ///< consecutive, by sensor
  int most_rejections_;             ///< in a row; 0: without bound
};

}  // namespace alidade::internal
