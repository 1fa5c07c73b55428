// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <span>

namespace alidade::internal {

inline constexpr double kNotANumber = std::numeric_limits<double>::quiet_NaN();

/// 0; not a number if one of the values is infinite or not a number.
[[gnu::always_inline]] inline double ZeroIfFinite(std::span<const double> values) {
  double sum = 0.0;
  for (const double *value = values.data(), *end = value + values.size(); value != end; ++value) {
    sum += 0.0 * *value;
  }
  return sum;
}
/// Whether none of the values is infinite or not a number.
[[gnu::always_inline]] inline bool AllFinite(std::span<const double> values) {
  return ZeroIfFinite(values) == 0.0;
}

}  // namespace alidade::internal
