// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <numeric>
#include <span>

/// q and -q are one rotation; which of the two is written is settled here.
namespace alidade::internal {

/// Of q and -q the one nearer to `near`; where `near` is empty, the one whose first element that
/// is not zero is positive.
inline void ChooseSign(std::span<const double> near, std::span<double> q) {
  const auto first = std::ranges::find_if(q, [](double element) { return element != 0.0; });
  const double along = !near.empty() ? std::inner_product(q.begin(), q.end(), near.begin(), 0.0)
                       : first == q.end() ? 0.0
                                          : *first;
  const double sign = along < 0.0 ? -1.0 : 1.0;
  for (double& element : q) element = element == 0.0 ? 0.0 : sign * element;  // no -0 either
}

}  // namespace alidade::internal
