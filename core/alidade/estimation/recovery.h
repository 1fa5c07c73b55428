// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/estimation/filter.h"
#include "alidade/estimation/pending_measurements.h"

namespace alidade::internal {

/// Recovery of a filter: repairs P if rounding made it indefinite, and resets blocks if a sensor is
/// rejected too often in a row. A copy is a snapshot.
class Recovery {
 public:
  explicit Recovery(const EkfOptions& options) : options_(options) {}

  /// Sets the negative pivots of the L D L' of P to zero, if P is not positive semi-definite (event
  /// `repaired`). After max_covariance_repairs repairs the next one ends the filter. Called after
  /// an update whose S was not positive definite.
  void RepairCovariance(FilterState& f);
  /// Resets the block that the measurement determines (event `rejection_recovery`). The covariance
  /// of the other blocks of its motion model becomes an upper bound of prior and current
  /// covariance. If a reset is not possible, inflates the covariance of the blocks of the sensor,
  /// once until its next acceptance. Called when the sensor was rejected too often in a row.
  void Recover(FilterState& f, PendingMeasurement& pending);

 private:
  EkfOptions options_;
  int repairs_ = 0;
};

}  // namespace alidade::internal
