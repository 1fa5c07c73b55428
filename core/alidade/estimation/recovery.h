// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/estimation/filter.h"
#include "alidade/estimation/pending_measurements.h"

namespace alidade::internal {

/// Recovery of a filter. Repairs P if rounding errors made P indefinite. Resets or inflates blocks
/// if too many consecutive measurements of a sensor were rejected. A copy is a snapshot.
class Recovery {
 public:
  explicit Recovery(const EkfOptions& options) : options_(options) {}

  /// Must be called after an update whose S was not positive definite. If P = L D L' is not
  /// positive semi-definite, sets the negative pivots to zero (event `repaired`). Ends the filter
  /// if more than max_covariance_repairs repairs are needed.
  void RepairCovariance(FilterState& f);
  /// Must be called when too many consecutive measurements of a sensor were rejected. Resets the
  /// block that the measurement determines (event `rejection_recovery`). Sets the covariance of the
  /// other blocks of the same motion model to an upper bound of prior and current covariance. If a
  /// reset is not possible, inflates the covariance of the sensor's blocks. A second inflation is
  /// possible only after a measurement of the sensor was accepted.
  void Recover(FilterState& f, PendingMeasurement& pending);

 private:
  EkfOptions options_;
  int repairs_ = 0;
};

}  // namespace alidade::internal
