// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "alidade/host/source.h"

namespace alidade::internal {

/// Estimate and truth of a scalar block over evenly spaced timestamps, for its lag. Only the first
/// ones are kept, so that memory and time of a long run do not grow with it.
struct LagSeries {
  static constexpr std::size_t kMost = 100'000;

  std::vector<double> estimate, truth;
  Timestamp first = 0, last = 0;
  Timestamp shortest = INT64_MAX, longest = 0;

  void Add(Timestamp timestamp, double true_value, double error) {
    if (truth.size() == kMost) return;
    if (truth.empty()) {
      first = timestamp;
    } else {
      shortest = std::min(shortest, timestamp - last);
      longest = std::max(longest, timestamp - last);
    }
    last = timestamp;
    truth.push_back(true_value);
    estimate.push_back(true_value - error);
  }
  double step_ms() const {
    return 1e-6 * static_cast<double>(last - first) / static_cast<double>(truth.size() - 1);
  }
  /// Within 5 % of the mean step: what a camera's clock does.
  bool even() const {
    if (truth.size() < 2 || shortest <= 0) return false;
    return 1e-6 * static_cast<double>(longest) < 1.05 * step_ms() &&
           1e-6 * static_cast<double>(shortest) > 0.95 * step_ms();
  }
};

}  // namespace alidade::internal
