// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "alidade/estimation/pending_measurements.h"

namespace alidade::internal {

/// One-point RANSAC [Civera2010]: divides the matches of a frame into inliers and outliers, for
/// sensors with the option outlier_rejection. A hypothesis is the state after an update by one
/// match alone. A match supports a hypothesis if its residual at that state is within the noise of
/// the match. The matches that support a hypothesis are its support.
class Consensus {
 public:
  explicit Consensus(const Problem& problem);

  /// Returns whether any of the measurements belongs to a sensor with outlier_rejection.
  static bool IsEnabledFor(std::span<PendingMeasurement* const> rows);
  /// Divides the measurements `rows` of a frame. Appends the support of the best hypothesis, and
  /// all measurements of sensors without outlier_rejection, to `inliers`, in the order of `rows`.
  /// Appends the other measurements to `remaining`. Each match is tried at most once. The number of
  /// hypotheses is log(1 - confidence) / log(1 - q), if the fraction q of the matches supports the
  /// best hypothesis. Equal seeds result in the same order of hypotheses.
  void Split(FilterState& f, std::span<PendingMeasurement* const> rows, std::uint64_t seed,
             std::vector<PendingMeasurement*>& inliers,
             std::vector<PendingMeasurement*>& remaining);
  /// Returns whether a measurement passes the rescue gate. This second gate is tested after the
  /// update by the support, for measurements outside the support.
  bool PassesRescueGate(const PendingMeasurement& pending) const {
    return pending.report->nis <= rescue_[static_cast<std::size_t>(pending.sensor)];
  }

 private:
  void FindBest(FilterState& f, std::uint64_t seed);
  void FindSupport(FilterState& f, std::size_t hypothesis);

  /// By sensor: thresholds on r' R^-1 r for the support, and on the NIS for the rescue gate.
  std::vector<double> support_, rescue_;

  // Reused memory.
  /// Matches of sensors with outlier_rejection.
  Scratch<std::vector<PendingMeasurement*>> matches_;
  std::vector<std::size_t> order_;    ///< order in which matches are tried
  std::vector<char> supports_;        ///< by match: whether it supports the current hypothesis
  std::vector<char> best_;            ///< by match: whether it supports the best hypothesis
  std::vector<double> h_, residual_;  ///< h and residual of one match
};

}  // namespace alidade::internal
