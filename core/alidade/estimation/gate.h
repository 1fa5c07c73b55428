// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "alidade/estimation/filter.h"
#include "alidade/estimation/pending_measurements.h"

namespace alidade::internal {

/// Which measurements may correct the state, each by itself: those with r' S^-1 r at most the
/// quantile of chi-square that has the gate's probability. Also the weight of a robust loss, which
/// depends on the same distance, and how often a sensor was rejected in a row. A copy is a
/// snapshot.
class Gate {
 public:
  Gate(const Problem& problem, const EkfOptions& options);

  /// Takes the NIS of a row with r, R and S, finds w, and returns whether it passes: kAccepted, or
  /// why not. What lies so far out that its R / w is not finite does not.
  Outcome Test(FilterState& f, PendingMeasurement& pending, double nis) {
    return nis <= thresholds_[static_cast<std::size_t>(pending.sensor)] ? Pass(f, pending, nis)
                                                                        : Refuse(f, pending, nis);
  }
  /// R <- R / w in R and in S, of rows that passed.
  void ApplyRobustWeights(std::span<PendingMeasurement* const> rows) const;

  /// Counts what became of one measurement. Whether its sensor was rejected so often in a row that
  /// it has to recover; from there it counts anew.
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
