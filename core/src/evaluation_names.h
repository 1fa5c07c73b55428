// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>

#include "alidade/evaluate.h"

namespace alidade::internal {

/// The statistics with evo's names, in its order.
inline constexpr std::pair<const char*, double ErrorStatistics::*> kStatistics[] = {
    {"rmse", &ErrorStatistics::rmse},     {"mean", &ErrorStatistics::mean},
    {"median", &ErrorStatistics::median}, {"std", &ErrorStatistics::std},
    {"min", &ErrorStatistics::min},       {"max", &ErrorStatistics::max},
    {"sse", &ErrorStatistics::sse}};

}  // namespace alidade::internal
