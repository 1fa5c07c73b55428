// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "alidade/config/config.h"

namespace alidade::internal {

/// A square, symmetric, positive semi-definite matrix of `size`, row-major; given as a list of
/// rows. Fails with the smallest eigenvalue if it is not PSD. Asymmetry up to 1e-9 of the standard
/// deviations is rounding: the mean of both entries is returned.
std::vector<double> ReadCovariance(const Node& node, int size);

}  // namespace alidade::internal
