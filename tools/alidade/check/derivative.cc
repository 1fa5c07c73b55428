// SPDX-License-Identifier: Apache-2.0
#include "alidade/check/derivative.h"

#include <limits>
#include <vector>

namespace alidade::internal {

std::optional<Derivative> Differentiate(const Curve& y, double h) {
  constexpr int kSteps = 10;
  constexpr double kShrink = 1.4;
  Derivative best;
  // Rows of the extrapolation tableau. The error of column j is of order h^(2 j + 2).
  std::vector<Eigen::ArrayXd> previous_row, row;
  for (int i = 0; i < kSteps; ++i, h /= kShrink) {
    const auto forward = y(h), backward = y(-h);
    if (!forward || !backward) return std::nullopt;
    row.assign(1, (*forward - *backward) / (2.0 * h));
    if (i == 0) {
      best.value = row[0];
      best.error.setConstant(row[0].size(), std::numeric_limits<double>::infinity());
    }
    double power = kShrink * kShrink;
    for (std::size_t j = 1; j <= previous_row.size(); ++j, power *= kShrink * kShrink) {
      row.push_back((power * row[j - 1] - previous_row[j - 1]) / (power - 1.0));
      const Eigen::ArrayXd error =
          (row[j] - row[j - 1]).abs().max((row[j] - previous_row[j - 1]).abs());
      const auto better = error < best.error;
      best.value = better.select(row[j], best.value);
      best.error = better.select(error, best.error).eval();
    }
    previous_row.swap(row);
  }
  return best;
}

}  // namespace alidade::internal
