// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "alidade/estimation/pending_measurements.h"

namespace alidade::internal {

/// One-point RANSAC [Civera2010]: separates the matches of a frame that agree from outliers, for
/// sensors with the option outlier_rejection. A hypothesis is the state after an update by one
/// match alone; its support are the matches whose residuals are then within their noise.
class Consensus {
 public:
  explicit Consensus(const Problem& problem);

  /// Whether any of the measurements is of a sensor with outlier_rejection.
  static bool IsAsked(std::span<PendingMeasurement* const> rows);
  /// Appends the measurements that support the best hypothesis, and those of other sensors, to
  /// `agreed`, in their order, and the others to `rest`. No match is tried twice. The number of
  /// hypotheses is log(1 - confidence) / log(1 - share of the support). The same `seed` tries them
  /// in the same order.
  void Split(FilterState& f, std::span<PendingMeasurement* const> rows, std::uint64_t seed,
             std::vector<PendingMeasurement*>& agreed, std::vector<PendingMeasurement*>& rest);
  /// Whether a measurement outside the support passes the gate after the update by the support.
  bool Rescues(const PendingMeasurement& pending) const {
    return pending.report->nis <= rescue_[static_cast<std::size_t>(pending.sensor)];
  }

 private:
  void FindBest(FilterState& f, std::uint64_t seed);
  void FindSupport(FilterState& f, std::size_t hypothesis);

  std::vector<double> support_, rescue_;  ///< bounds on r' R^-1 r and NIS, by sensor

  // Memory.
  Scratch<std::vector<PendingMeasurement*>> matches_;  ///< of sensors with outlier_rejection
  std::vector<std::size_t> order_;                     ///< of hypotheses
  std::vector<char> agrees_, best_;  ///< by match: whether it supports the hypothesis; the best
  std::vector<double> h_, r_;        ///< of one match
};

}  // namespace alidade::internal
