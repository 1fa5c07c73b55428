// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace alidade {

/// Time stamps are int64 nanoseconds from the source's own origin.
using Stamp = std::int64_t;

inline constexpr Stamp kNoStamp = INT64_MIN;

/// Nearest stamp to `t_s` seconds.
Stamp StampFromSeconds(double t_s);
inline double Seconds(Stamp t) { return 1e-9 * static_cast<double>(t); }

}  // namespace alidade
