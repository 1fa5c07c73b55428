// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "alidade/filter/filter.h"
#include "alidade/filter/filter_state.h"

namespace alidade::internal {

/// What a filter does when it goes wrong: repairs P where it is no longer positive semi-definite,
/// and takes back what it believes where a sensor is rejected too often in a row. A copy is a
/// snapshot.
class Recovery {
 public:
  Recovery(const System& system, const EkfOptions& options);

  /// After an update that left S not positive definite: where that is P's fault, negative pivots of
  /// its L D L' count as zero (event `repaired`). Ends the filter where it needed that too often.
  void RepairCovariance(FilterState& f, std::span<Row> rows);
  /// Counts rejections in a row for each sensor, and recovers one that was rejected too often
  /// (event `rejection_recovery`). Rejected landmarks do not count.
  void RecoverRejected(FilterState& f, std::span<Row> rows);

  /// Whether one more rejection of the sensor is one too many.
  bool IsDueNext(std::size_t sensor) const {
    return options_.rejection_recovery != RejectionRecovery::kNone &&
           rejections_[sensor] + 1 >= options_.rejection_recovery_after;
  }
  /// Counts what became of one measurement. Whether its sensor has to recover.
  bool Count(FilterState& f, const MeasurementReport& entry) {
    if (entry.outcome != Outcome::kAccepted && entry.outcome != Outcome::kInitialised) {
      return CountRejection(entry);
    }
    const auto sensor = static_cast<std::size_t>(entry.sensor);
    rejections_[sensor] = 0;
    inflated_[sensor] = f.said.out_of_domain[sensor] = 0;
    return false;
  }

 private:
  bool CountRejection(const MeasurementReport& entry);
  void Recover(FilterState& f, Row& row);

  EkfOptions options_;
  std::vector<int> rejections_;  ///< consecutive, by sensor
  std::vector<char> inflated_;   ///< since the last acceptance, by sensor
  int repairs_ = 0;              ///< of P, so far
};

}  // namespace alidade::internal
