// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "alidade/config/config.h"

namespace alidade::internal {

/// Reads a list of rows as a symmetric, positive semi-definite `size` x `size` matrix. Returns it
/// row-major. If the matrix is not positive semi-definite, the error contains its smallest
/// eigenvalue. A difference between (i, j) and (j, i) of at most 1e-9 times their standard
/// deviations counts as rounding; the mean replaces both entries.
std::vector<double> ReadCovariance(const Node& node, int size);

}  // namespace alidade::internal
