// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "alidade/config/config.h"

namespace alidade::internal {

/// Returns a symmetric, positive semi-definite `size` x `size` matrix, row-major, from a list of
/// rows. Fails with the smallest eigenvalue if the matrix is not positive semi-definite. Asymmetry
/// up to 1e-9 of the standard deviations counts as rounding: both entries become their mean.
std::vector<double> ReadCovariance(const Node& node, int size);

}  // namespace alidade::internal
