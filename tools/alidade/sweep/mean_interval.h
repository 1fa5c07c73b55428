// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "alidade/base/statistics.h"

namespace alidade::internal {

/// Returns the 95 % confidence interval of the mean of n independent values,
///
///   mean -+ t s / sqrt(n),   s^2 = sum (x_i - mean)^2 / (n - 1)
///
/// t is the 97.5 % quantile of Student's distribution with n - 1 degrees of freedom. The bounds
/// are NaN for n < 2.
Interval MeanInterval(const std::vector<double>& values);

}  // namespace alidade::internal
