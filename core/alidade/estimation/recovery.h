// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/estimation/filter.h"
#include "alidade/estimation/pending_measurements.h"

namespace alidade::internal {

/// What a filter does when it goes wrong: repairs P where it is no longer positive semi-definite,
/// and takes back what it believes where a sensor is rejected too often in a row. A copy is a
/// snapshot.
class Recovery {
 public:
  explicit Recovery(const EkfOptions& options) : options_(options) {}

  /// After an update that left S not positive definite: where that is P's fault, negative pivots of
  /// its L D L' count as zero (event `repaired`). Ends the filter where it needed that too often.
  void RepairCovariance(FilterState& f);
  /// Once the sensor of a row was rejected too often, one frame after the other (event
  /// `rejection_recovery`): resets what it determines from its measurement, with the blocks that
  /// move with it at their prior uncertainty, or theirs where that is larger; where that cannot be,
  /// inflates the blocks that it corrects, once until it is accepted again.
  void Recover(FilterState& f, PendingMeasurement& pending);

 private:
  EkfOptions options_;
  int repairs_ = 0;  ///< of P, so far
};

}  // namespace alidade::internal
