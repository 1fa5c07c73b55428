// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace alidade {

/// Timestamps are int64 nanoseconds from the source's own origin.
using Timestamp = std::int64_t;

inline constexpr Timestamp kNoTimestamp = INT64_MIN;

/// Nearest timestamp to `t_s` seconds; requires |t_s| < 9.2e9 (292 years).
Timestamp TimestampFromSeconds(double t_s);
inline double Seconds(Timestamp t) { return 1e-9 * static_cast<double>(t); }

}  // namespace alidade
