// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <span>

namespace alidade::internal {

inline constexpr double kNotANumber = std::numeric_limits<double>::quiet_NaN();

/// Returns 0, or NaN if a value is infinite or NaN.
[[gnu::always_inline]] inline double ZeroIfFinite(std::span<const double> values) {
  double sum = 0.0;
  for (const double *value = values.data(), *end = value + values.size(); value != end; ++value) {
    sum += 0.0 * *value;
  }
  return sum;
}
/// Returns true if all values are finite.
[[gnu::always_inline]] inline bool AllFinite(std::span<const double> values) {
  return ZeroIfFinite(values) == 0.0;
}

}  // namespace alidade::internal
