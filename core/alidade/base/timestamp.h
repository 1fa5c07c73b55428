// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace alidade {

/// Timestamp in nanoseconds from an origin that the source defines.
using Timestamp = std::int64_t;

inline constexpr Timestamp kNoTimestamp = INT64_MIN;

/// Returns the timestamp nearest to `t_s` seconds; requires |t_s| < 9.2e9 (292 years).
Timestamp TimestampFromSeconds(double t_s);
inline double Seconds(Timestamp t) { return 1e-9 * static_cast<double>(t); }

}  // namespace alidade
