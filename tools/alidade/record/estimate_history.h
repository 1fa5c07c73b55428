// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "alidade/record/column_tables.h"

namespace alidade::internal {

/// Timestamps at which the error of an element was outside 3 sigma.
struct Excursion {
  std::string element;
  std::int64_t outside = 0;                             ///< number of these timestamps
  std::int64_t longest = 0;                             ///< length of the longest run of them
  Timestamp first = kNoTimestamp, last = kNoTimestamp;  ///< ends of the longest run
};

/// Sudden decrease of the standard deviation of the position, for example at a loop closure.
struct SigmaFall {
  std::int64_t row = 0;  ///< index of the estimate after the decrease
  Timestamp timestamp = kNoTimestamp;
  double sigma_before = 0.0, sigma_after = 0.0;  ///< sqrt(tr P) of the position
  double error_before = 0.0, error_after = 0.0;  ///< |e| of the position; NaN: unknown

  double ratio() const { return sigma_after / sigma_before; }
};

/// Last estimate of an element without truth, with its standard deviation.
struct FinalValue {
  std::string element, owner, unit;
  double value = 0.0, sigma = 0.0;
};

/// Facts about the estimates of one estimator over time that its metrics do not contain.
class EstimateHistory {
 public:
  explicit EstimateHistory(const std::vector<BlockLayout>& blocks);

  void Add(const SourceFrame& frame, const State& state);
  std::int64_t rows() const { return rows_; }
  /// Returns the name of the position: the first vector of 2 or 3 elements `X.position`, or "".
  std::string position() const { return position_ ? blocks_[*position_].name : ""; }
  /// Returns the length of the path through the true positions; 0 if the truth is unknown.
  double path() const { return path_; }
  /// Returns the excursion with the longest run of timestamps; nullopt if no error was outside.
  std::optional<Excursion> LongestExcursion() const;
  /// Returns the last estimates of the elements without truth.
  std::vector<FinalValue> FinalValues() const;
  /// Returns the largest decrease of the sigma of the position to less than a half, without the
  /// first tenth of the estimates.
  std::optional<SigmaFall> LargestFall() const;

 private:
  /// Excursion of one element, and its current run of timestamps.
  struct ElementHistory {
    Excursion excursion;
    std::int64_t current = 0;
    Timestamp current_first = kNoTimestamp;
  };

  void AddPosition(const BlockRow& row, Timestamp timestamp);
  static void AddError(bool is_outside, Timestamp timestamp, ElementHistory& element);

  std::vector<BlockLayout> blocks_;
  std::vector<std::vector<ElementHistory>> elements_;  ///< tangent elements of each block
  std::optional<std::size_t> position_;                ///< index of the position
  std::int64_t rows_ = 0;
  std::vector<double> last_truth_;  ///< previous true position
  double path_ = 0.0;
  SigmaFall next_fall_;  ///< sigma and error before the next estimate
  /// Decreases to less than a half that no later decrease exceeds.
  std::vector<SigmaFall> falls_;
  /// Last estimate of a block.
  struct Estimate {
    std::vector<double> values, sigmas;
  };
  std::vector<Estimate> last_;  ///< of each block; empty if the block has truth
};

}  // namespace alidade::internal
