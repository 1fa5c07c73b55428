// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "alidade/filter/filter_state.h"

namespace alidade::internal {

/// Which measurements may correct the state, each by itself: those with r' S^-1 r at most the
/// quantile of chi-square that has the gate's probability. Also the weight of a robust loss, which
/// depends on the same distance.
class Gate {
 public:
  /// Of S, less noise than this vanishes compared with H P H'.
  static constexpr double kVanishing = 1e-13;

  /// `probability` >= 1: all that is finite passes.
  Gate(const System& system, double probability);

  /// NIS and w of a row with r, R and S, and whether it passes: kAccepted, or why not. What lies so
  /// far out that its R / w is not finite does not.
  Outcome Pass(FilterState& f, Row& row);
  /// R <- R / w in R and in S.
  static void Weigh(Row& row);

  double threshold(std::size_t sensor) const { return thresholds_[sensor]; }
  /// Whether it was said that the noise of a sensor vanishes compared with H P H'.
  bool warned(std::size_t sensor) const { return warned_[sensor]; }

 private:
  void CheckConditioning(FilterState& f, const Row& row);

  std::vector<double> thresholds_;  ///< on r' S^-1 r, by sensor
  std::vector<bool> warned_;        ///< by sensor
  Scratch<std::vector<double>> memory_;
};

}  // namespace alidade::internal
