// SPDX-License-Identifier: Apache-2.0
#pragma once

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
  Outcome Test(FilterState& f, Row& row, double nis);
  /// R <- R / w in R and in S.
  static void ApplyRobustWeight(Row& row);

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
  static Outcome Defect(FilterState& f, Row& row);
  void CheckConditioning(FilterState& f, const Row& row);
  bool CountRejection(const MeasurementReport& entry);

  std::vector<double> thresholds_;  ///< on r' S^-1 r, by sensor
  std::vector<bool> warned_;        ///< by sensor
  std::vector<int> rejections_;     ///< consecutive, by sensor
  int most_rejections_;             ///< in a row; 0: without bound
};

}  // namespace alidade::internal
