// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

namespace alidade {

/// Quantile q, in [0, 1], of chi-square with `dof` > 0 degrees of freedom.
double ChiSquareQuantile(double q, int dof);

/// Quantile q, in [0, 1], of ascending values x[0..n-1], n > 0, linear between order statistics
/// (type 7 of Hyndman and Fan): with h = (n - 1) q, x[floor h] + (h - floor h) (x[floor h + 1] -
/// x[floor h]).
double Quantile(const std::vector<double>& ascending, double q);

/// Mean and quantiles of values.
struct Spread {
  double mean = 0.0, p05 = 0.0, p50 = 0.0, p95 = 0.0;
};
/// Of those values that are numbers; NaN where there is none.
Spread SpreadOf(std::vector<double> values);

/// Delay of `signal` after `reference`, both sampled every `step`, in the unit of step: the shift
/// k, |k| <= min(n/4, 2000), with the largest correlation coefficient over the n - |k| samples
/// that overlap, refined by a parabola. On a ramp, where `reference` correlates with itself by more
/// than 0.9 at every such k, that tells nothing: there it is the k with the least mean of
/// (signal(i + k) - reference(i))^2, and an offset counts as delay. NaN where one of them is
/// constant, the best k lies at the edge or is no better than its neighbours, or n < 8.
double Lag(const std::vector<double>& signal, const std::vector<double>& reference, double step);

/// How a series of rms values comes to its steady level; NaN of fewer than 40 values.
struct Settling {
  double level;  ///< the median of its last half
  /// How many values it takes until the rms of the last 10 of them is within 20 % of the level and
  /// stays there: at least 10; infinity where it is not there at the end.
  double count;
};
/// When a series of rms values, one for each frame say, has settled.
Settling SettlingOf(const std::vector<double>& rms);

}  // namespace alidade
