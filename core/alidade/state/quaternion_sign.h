// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <numeric>
#include <span>

/// Choice of the sign of a quaternion. q and -q represent the same rotation. An output contains
/// only one of these two quaternions.
namespace alidade::internal {

/// Replaces q by -q if -q is nearer to `reference`. If `reference` is empty, makes the first
/// non-zero element positive.
inline void ChooseSign(std::span<const double> reference, std::span<double> q) {
  const auto first = std::ranges::find_if(q, [](double element) { return element != 0.0; });
  const double product = !reference.empty()
                             ? std::inner_product(q.begin(), q.end(), reference.begin(), 0.0)
                         : first == q.end() ? 0.0
                                            : *first;
  const double sign = product < 0.0 ? -1.0 : 1.0;
  // Also replaces -0 by 0.
  for (double& element : q) element = element == 0.0 ? 0.0 : sign * element;
}

}  // namespace alidade::internal
