// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <span>

namespace alidade::internal {

/// What a model has not written.
inline constexpr double kNotWritten = std::numeric_limits<double>::quiet_NaN();

/// Whether none of the values is infinite or not a number.
[[gnu::always_inline]] inline bool AllFinite(std::span<const double> values) {
  double sums[4] = {};  // that do not wait for one another
  std::size_t i = 0;
  for (; i + 4 <= values.size(); i += 4) {
    for (std::size_t k = 0; k < 4; ++k) sums[k] += 0.0 * values[i + k];
  }
  double sum = (sums[0] + sums[1]) + (sums[2] + sums[3]);
  for (; i < values.size(); ++i) sum += 0.0 * values[i];
  return sum == 0.0;  // 0 times what is not finite is not a number
}

}  // namespace alidade::internal
