// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "alidade/estimation/filter.h"
#include "alidade/estimation/update_method.h"

namespace alidade::internal {

/// Recovery of a filter. Repairs P if rounding errors made it indefinite. Counts the consecutive
/// rejections of each sensor, and resets or inflates blocks if there are too many. A copy is a
/// snapshot.
///
/// After N = rejection_recovery_after rejections in a row, or if measurements were rejected for
/// rejection_recovery_after_s, a recovery is attempted. If the sensor is still rejected, the
/// next attempt follows after 2 N, then 4 N, 8 N and 16 N rejections, or the respective time. After
/// kMaxAttempts attempts, the recovery has failed (event `recovery_failed`).
class Recovery {
 public:
  static constexpr int kMaxAttempts = 5;
  /// Number of consecutive rejections from which a sensor is mostly rejected (event
  /// `mostly_rejected`, and the verdict).
  static constexpr int kMostlyRejected = 20;

  explicit Recovery(const Problem& problem, const EkfOptions& options)
      : options_(options), sensors_(problem.sensors.size()) {}

  /// Called after an update whose S was not positive definite. If P = L D L' is not positive
  /// semi-definite, sets its negative pivots to zero (event `repaired`). Ends the filter if more
  /// than max_covariance_repairs repairs are needed.
  void RepairCovariance(FilterState& f, UpdateMethod& method);
  /// Counts the outcome of a measurement, and recovers if an attempt is due.
  void Count(FilterState& f, PendingMeasurement& pending, UpdateMethod& method) {
    if (!InfoOf(pending.report->outcome).is_used) return CountRejection(f, pending, method);
    sensors_[static_cast<std::size_t>(pending.sensor)] = {};
    f.health.out_of_domain[static_cast<std::size_t>(pending.sensor)] = 0;
  }

 private:
  /// Rejections of a sensor since its last accepted measurement.
  struct Rejections {
    int count = 0;
    int attempts = 0;                ///< attempts of a recovery
    Timestamp first = kNoTimestamp;  ///< time of the first rejection
  };

  void CountRejection(FilterState& f, PendingMeasurement& pending, UpdateMethod& method);
  bool IsDue(const FilterState& f, const Rejections& rejections) const;
  std::string Recover(FilterState& f, PendingMeasurement& pending) const;

  EkfOptions options_;
  std::vector<Rejections> sensors_;
  int repairs_ = 0;
};

}  // namespace alidade::internal
