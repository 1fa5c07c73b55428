// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/estimation/filter.h"
#include "alidade/estimation/pending_measurements.h"

namespace alidade::internal {

/// Repairs P if it is no longer positive semi-definite, and resets blocks if a sensor is rejected
/// too often in a row. A copy is a snapshot.
class Recovery {
 public:
  explicit Recovery(const EkfOptions& options) : options_(options) {}

  /// Called after an update whose S was not positive definite. If P is the cause, sets the negative
  /// pivots of its L D L' to zero (event `repaired`). After max_covariance_repairs of that it ends
  /// the filter.
  void RepairCovariance(FilterState& f);
  /// Called when the sensor of a measurement was rejected too often in a row (event
  /// `rejection_recovery`). Resets the block that the measurement determines, and the covariance of
  /// the blocks that move with it to the prior, or keeps theirs if it is larger. If a reset is not
  /// possible, inflates the covariance of the blocks of the sensor, once until its next acceptance.
  void Recover(FilterState& f, PendingMeasurement& pending);

 private:
  EkfOptions options_;
  int repairs_ = 0;
};

}  // namespace alidade::internal
