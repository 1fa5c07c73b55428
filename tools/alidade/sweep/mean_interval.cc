// SPDX-License-Identifier: Apache-2.0
#include "alidade/sweep/mean_interval.h"

#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <limits>

namespace alidade::internal {

Interval MeanInterval(const std::vector<double>& values) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  if (values.size() < 2) return {kNaN, kNaN};
  const auto n = static_cast<double>(values.size());
  const double mean = Mean(values);
  const double t = boost::math::quantile(boost::math::students_t(n - 1.0), 0.975);
  const double half = t * std::sqrt(SquaredDeviation(values) / (n - 1.0) / n);
  return {mean - half, mean + half};
}

}  // namespace alidade::internal
