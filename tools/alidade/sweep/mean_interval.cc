// SPDX-License-Identifier: Apache-2.0
#include "alidade/sweep/mean_interval.h"

#include <cmath>
#include <limits>

namespace alidade::internal {
namespace {

/// Returns the 97.5 % quantile of Student's distribution with `dof` degrees of freedom, by its
/// expansion in powers of 1 / dof around the quantile z of the normal distribution.
double StudentQuantile(double dof) {
  if (dof < 1.5) return 12.706;
  if (dof < 2.5) return 4.303;
  constexpr double z = 1.959964, z2 = z * z;
  constexpr double g1 = z * (z2 + 1.0) / 4.0;
  constexpr double g2 = z * ((5.0 * z2 + 16.0) * z2 + 3.0) / 96.0;
  constexpr double g3 = z * (((3.0 * z2 + 19.0) * z2 + 17.0) * z2 - 15.0) / 384.0;
  return z + (g1 + (g2 + g3 / dof) / dof) / dof;
}

}  // namespace

Interval MeanInterval(const std::vector<double>& values) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  if (values.size() < 2) return {kNaN, kNaN};
  const auto n = static_cast<double>(values.size());
  double sum = 0.0, squares = 0.0;
  for (const double value : values) sum += value;
  const double mean = sum / n;
  for (const double value : values) squares += (value - mean) * (value - mean);
  const double half = StudentQuantile(n - 1.0) * std::sqrt(squares / (n - 1.0) / n);
  return {mean - half, mean + half};
}

}  // namespace alidade::internal
