// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "alidade/estimation/pending_measurements.h"

namespace alidade::internal {

/// One-point RANSAC [Civera2010]: separates the inliers among the matches of a frame from the
/// outliers, for sensors with the option outlier_rejection. A hypothesis is the state after an
/// update by one match alone. The support of a hypothesis consists of the matches whose residuals
/// are then within their noise.
class Consensus {
 public:
  explicit Consensus(const Problem& problem);

  /// Returns whether any of the measurements belongs to a sensor with outlier_rejection.
  static bool IsEnabledFor(std::span<PendingMeasurement* const> rows);
  /// Divides the measurements of a frame. Appends the support of the best hypothesis, and the
  /// measurements of sensors without outlier_rejection, to `inliers`, in their order. Appends the
  /// other ones to `remaining`. No match is tried twice. The number of hypotheses is
  /// log(1 - confidence) / log(1 - share of the support). The same `seed` results in the same order
  /// of hypotheses.
  void Split(FilterState& f, std::span<PendingMeasurement* const> rows, std::uint64_t seed,
             std::vector<PendingMeasurement*>& inliers,
             std::vector<PendingMeasurement*>& remaining);
  /// Returns whether a measurement outside the support passes the gate after the update by the
  /// support.
  bool PassesRescueGate(const PendingMeasurement& pending) const {
    return pending.report->nis <= rescue_[static_cast<std::size_t>(pending.sensor)];
  }

 private:
  void FindBest(FilterState& f, std::uint64_t seed);
  void FindSupport(FilterState& f, std::size_t hypothesis);

  std::vector<double> support_, rescue_;  ///< thresholds on r' R^-1 r and NIS, by sensor

  // Reused memory.
  Scratch<std::vector<PendingMeasurement*>> matches_;  ///< of sensors with outlier_rejection
  std::vector<std::size_t> order_;                     ///< of hypotheses
  std::vector<char> supports_;        ///< by match: whether it supports the current hypothesis
  std::vector<char> best_;            ///< by match: whether it supports the best hypothesis
  std::vector<double> h_, residual_;  ///< of one match
};

}  // namespace alidade::internal
