// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "alidade/config/config.h"

namespace alidade::internal {

/// Reads a list of rows as a symmetric, positive semi-definite `size` x `size` matrix. Returns it
/// row-major. If the matrix is not positive semi-definite, the error reports the smallest
/// eigenvalue. The entries (i, j) and (j, i) may differ by rounding errors, up to 1e-9 times the
/// product of the standard deviations i and j. The mean then replaces both entries.
std::vector<double> ReadCovariance(const Node& node, int size);

}  // namespace alidade::internal
