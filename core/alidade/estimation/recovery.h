// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/estimation/filter.h"
#include "alidade/estimation/pending_measurements.h"

namespace alidade::internal {

/// Recovery of a filter. Repairs P if rounding errors made it indefinite. Resets or inflates blocks
/// if a sensor is rejected too often in a row. A copy is a snapshot.
class Recovery {
 public:
  explicit Recovery(const EkfOptions& options) : options_(options) {}

  /// Called after an update whose S was not positive definite. If P = L D L' is not positive
  /// semi-definite, sets its negative pivots to zero (event `repaired`). Ends the filter if more
  /// than max_covariance_repairs repairs are needed.
  void RepairCovariance(FilterState& f);
  /// Called when a sensor was rejected too often in a row. Resets the block that the measurement
  /// determines (event `rejection_recovery`). Sets the covariance of the other blocks of the same
  /// motion model to an upper bound of prior and current covariance. If a reset is not possible,
  /// inflates the covariance of the sensor's blocks. This is done only once before a measurement of
  /// the sensor is accepted again.
  void Recover(FilterState& f, PendingMeasurement& pending);

 private:
  EkfOptions options_;
  int repairs_ = 0;
};

}  // namespace alidade::internal
