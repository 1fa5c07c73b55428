// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "alidade/compare/compare.h"
#include "alidade/report/conclusion.h"

namespace alidade::internal {

/// Minimum number of runs for which the interval of a ratio is reliable. With fewer runs, the
/// interval contains the ratio with less than the nominal probability. According to the t
/// distribution, the 95 % interval would be 2.7 times as wide for three runs, and 1.2 times as wide
/// for ten runs.
inline constexpr std::int64_t kFewRuns = 10;

/// Formats a ratio with its interval, as in `1.0110 [0.9930, 1.0302] undecided`, or with half of
/// the width of its interval, as in `1.0110 +- 0.019 undecided`.
std::string RatioText(const Ratio& ratio, bool with_interval = true);

/// Returns the sentences about a comparison: one for each step of the decomposition, one about the
/// least error and the least CPU time, and over several seeds ConsistencyOf().
std::vector<Conclusion> ConclusionsOf(const Comparison& comparison);

}  // namespace alidade::internal
