// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "alidade/estimation/filter.h"
#include "alidade/estimation/rows.h"

namespace alidade::internal {

/// Which measurements may correct the state, each by itself: those with r' S^-1 r at most the
/// quantile of chi-square that has the gate's probability. Also the weight of a robust loss, which
/// depends on the same distance, and how often a sensor was rejected in a row. A copy is a
/// snapshot.
class Gate {
 public:
  Gate(const System& system, const EkfOptions& options);

  /// Takes the NIS of a row with r, R and S, finds w, and returns whether it passes: kAccepted, or
  /// why not. What lies so far out that its R / w is not finite does not.
  Outcome Test(FilterState& f, Row& row, double nis) {
    return nis <= thresholds_[static_cast<std::size_t>(row.sensor)] ? Pass(f, row, nis)
                                                                    : Refuse(f, row, nis);
  }
  /// R <- R / w in R and in S, of rows that passed.
  void ApplyRobustWeights(std::span<Row* const> rows) const;

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
  Outcome Pass(FilterState& f, Row& row, double nis) {
    CheckConditioning(f, row);
    row.report->nis = nis;
    row.weight = 1.0;
    return row.binding->loss.kind == LossKind::kNone ? Outcome::kAccepted : Weigh(row, nis);
  }
  Outcome Refuse(FilterState& f, Row& row, double nis);
  static Outcome Defect(FilterState& f, Row& row);
  static Outcome Weigh(Row& row, double nis);
  void CheckConditioning(FilterState& f, const Row& row) {
    const auto m = static_cast<std::size_t>(row.place->dof);
    for (std::size_t i = 0; i < m; ++i) {  // on the diagonals of R and S
      const std::size_t at = i * (m + 1);
      if (!(row.R[at] > 1e-13 * row.s[at])) return WarnOfConditioning(f, row, at);
    }
  }
  void WarnOfConditioning(FilterState& f, const Row& row, std::size_t i);
  bool CountRejection(const MeasurementReport& entry);

  bool gates_;                      ///< whether there is a gate: else what overflows passes too
  std::vector<double> thresholds_;  ///< on r' S^-1 r, by sensor; finite
  bool weighs_ = false;             ///< whether a sensor has a robust loss
  std::vector<bool> warned_;        ///< by sensor
  std::vector<int> rejections_;     ///< consecutive, by sensor
  int most_rejections_;             ///< in a row; 0: without bound
};

}  // namespace alidade::internal
