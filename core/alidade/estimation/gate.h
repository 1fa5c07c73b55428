// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "alidade/estimation/filter.h"
#include "alidade/estimation/pending_measurements.h"

namespace alidade::internal {

/// Chi-square gate: accepts a measurement if its NIS r' S^-1 r is at most the chi-square quantile
/// of the probability EkfOptions::gate. Also computes the weight of the robust loss, and counts
/// consecutive rejections of each sensor. A copy is a snapshot.
class Gate {
 public:
  Gate(const Problem& problem, const EkfOptions& options);

  /// Compares the NIS of a measurement with the threshold, and computes the robust weight w.
  /// Returns kAccepted, or the reason for a rejection. A measurement is also rejected if R / w is
  /// not finite.
  Outcome Test(FilterState& f, PendingMeasurement& pending, double nis) {
    return nis <= thresholds_[static_cast<std::size_t>(pending.sensor)] ? Accept(f, pending, nis)
                                                                        : Reject(f, pending, nis);
  }
  /// Replaces R by R / w in the measurements `rows`, and corrects their S accordingly.
  void ApplyRobustWeights(std::span<PendingMeasurement* const> rows) const;

  /// Counts the outcome of a measurement. Returns true if the consecutive rejections of its sensor
  /// reached the limit, so that the filter has to recover. The count then restarts at zero.
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
  Outcome Accept(FilterState& f, PendingMeasurement& pending, double nis) {
    CheckConditioning(f, pending);
    pending.report->nis = nis;
    pending.weight = 1.0;
    return pending.binding->loss.kind == LossKind::kNone ? Outcome::kAccepted
                                                         : ComputeRobustWeight(pending, nis);
  }
  Outcome Reject(FilterState& f, PendingMeasurement& pending, double nis);
  static Outcome CheckFinite(FilterState& f, PendingMeasurement& pending);
  static Outcome ComputeRobustWeight(PendingMeasurement& pending, double nis);
  void CheckConditioning(FilterState& f, const PendingMeasurement& pending) {
    const auto m = static_cast<std::size_t>(pending.place->dof);
    for (std::size_t i = 0; i < m; ++i) {
      const std::size_t diagonal = i * (m + 1);
      if (!(pending.R[diagonal] > 1e-13 * pending.s[diagonal])) {
        return WarnOfConditioning(f, pending, diagonal);
      }
    }
  }
  void WarnOfConditioning(FilterState& f, const PendingMeasurement& pending, std::size_t i);
  bool CountRejection(const MeasurementReport& entry);

  bool has_gate_;                   ///< if false, an infinite NIS is also accepted
  std::vector<double> thresholds_;  ///< by sensor: largest accepted r' S^-1 r; finite
  bool has_robust_loss_ = false;    ///< whether any sensor has a robust loss
  std::vector<bool> is_warned_;     ///< by sensor: whether bad conditioning was reported
  std::vector<int> rejections_;     ///< by sensor: number of consecutive rejections
  int max_rejections_;              ///< limit of consecutive rejections; 0: unlimited
};

}  // namespace alidade::internal
