// SPDX-License-Identifier: Apache-2.0
#include "alidade/source.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "alidade/error.h"

namespace alidade {

Stamp StampFromSeconds(double t_s) {
  constexpr Stamp kPerSecond = 1'000'000'000;
  ALIDADE_EXPECTS(std::abs(t_s) < 9.2e9);  // 2^63 ns; false for nan
  const double whole_s = std::floor(t_s);  // the rest is exact, so that only one step rounds
  return static_cast<Stamp>(whole_s) * kPerSecond + std::llround(1e9 * (t_s - whole_s));
}

Stamp PartsOf(Stamp elapsed, double max_dt_s) {
  constexpr double kBeyond = 9.2e18;  // what a Stamp cannot hold
  if (elapsed <= 0) return 0;
  const double ns = std::round(1e9 * max_dt_s);
  const Stamp longest =
      ns < kBeyond ? std::max<Stamp>(1, static_cast<Stamp>(ns)) : std::numeric_limits<Stamp>::max();
  return (elapsed - 1) / longest + 1;
}

}  // namespace alidade
