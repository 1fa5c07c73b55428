// SPDX-License-Identifier: Apache-2.0
#include "alidade/base/timestamp.h"

#include <algorithm>
#include <cmath>

#include "alidade/base/error.h"

namespace alidade {

Timestamp TimestampFromSeconds(double t_s) {
  constexpr Timestamp kPerSecond = 1'000'000'000;
  ALIDADE_EXPECTS(std::abs(t_s) < 9.2e9);  // below 2^63 ns; the condition is false for NaN
  const double whole_s = std::floor(t_s);  // makes the next subtraction exact
  return static_cast<Timestamp>(whole_s) * kPerSecond + std::llround(1e9 * (t_s - whole_s));
}

}  // namespace alidade
