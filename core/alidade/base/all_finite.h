// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <span>

namespace alidade::internal {

/// What a model has not written.
inline constexpr double kNotWritten = std::numeric_limits<double>::quiet_NaN();

/// Whether none of the values is infinite or not a number.
inline bool AllFinite(std::span<const double> values) {
  double sum = 0.0;  // 0 times what is not finite is not a number
  for (const double value : values) sum += 0.0 * value;
  return sum == 0.0;
}

}  // namespace alidade::internal
