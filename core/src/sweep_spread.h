// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "alidade/sweep.h"

namespace alidade::internal {

/// Mean and quantiles of those values that are numbers; NaN where there is none.
Spread SpreadOf(std::vector<double> values);

}  // namespace alidade::internal
