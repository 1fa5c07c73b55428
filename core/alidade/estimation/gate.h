// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "alidade/estimation/filter.h"
#include "alidade/estimation/pending_measurements.h"

namespace alidade::internal {

/// Chi-square gate: accepts a measurement if its NIS r' S^-1 r is at most the chi-square quantile
/// of the probability EkfOptions::gate. Also computes the weight of the robust loss. A copy is a
/// snapshot.
class Gate {
 public:
  Gate(const Problem& problem, const EkfOptions& options);

  /// Compares the NIS of a measurement with the threshold, and computes the robust weight w.
  /// Returns kAccepted, or the reason for a rejection. A measurement is also rejected if R / w is
  /// not finite.
  Outcome Test(FilterState& f, PendingMeasurement& pending, double nis) {
    return nis <= thresholds_[static_cast<std::size_t>(pending.sensor)] ? Accept(pending, nis)
                                                                        : Reject(f, pending, nis);
  }
  /// Replaces R by R / w in the measurements `rows`, and corrects their S accordingly.
  void ApplyRobustWeights(std::span<PendingMeasurement* const> rows) const;

 private:
  static Outcome Accept(PendingMeasurement& pending, double nis) {
    pending.report->nis = nis;
    pending.weight = 1.0;
    return pending.binding->loss.kind == LossKind::kNone ? Outcome::kAccepted
                                                         : ComputeRobustWeight(pending, nis);
  }
  Outcome Reject(FilterState& f, PendingMeasurement& pending, double nis);
  static Outcome CheckFinite(FilterState& f, PendingMeasurement& pending);
  static Outcome ComputeRobustWeight(PendingMeasurement& pending, double nis);

  bool has_gate_;                   ///< if false, an infinite NIS is also accepted
  std::vector<double> thresholds_;  ///< by sensor: largest accepted r' S^-1 r; finite
  bool has_robust_loss_ = false;    ///< whether any sensor has a robust loss
};

}  // namespace alidade::internal
