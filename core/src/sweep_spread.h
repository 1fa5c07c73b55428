// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "alidade/sweep.h"

namespace alidade::internal {

/// Mean and quantiles of at least one value.
Spread SpreadOf(std::vector<double> values);

}  // namespace alidade::internal
