// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <vector>

namespace alidade {

/// Quantile q, in [0, 1], of chi-square with `dof` > 0 degrees of freedom.
double ChiSquareQuantile(double q, double dof);

/// A closed interval.
struct Interval {
  double low, high;
};

/// Where the mean of n independent values of chi2(dof) / dof lies with probability 0.95
/// [BarShalom2001, sec. 5.4]: the mean NEES or NIS of a consistent filter. n need not be whole.
///
///   [low, high] = m chi2(p, nu) / nu,   p = 0.025, 0.975,   nu = 2 n m^2 / v
///
/// m and v are mean and variance of a value; m = 1, v = 2 / dof and nu = n dof, but where a gate
/// takes the values up to `cut` alone, cut = r' S^-1 r, not divided by dof.
Interval ConsistencyBounds(double dof, double n,
                           double cut = std::numeric_limits<double>::infinity());

/// Integrated autocorrelation time tau = 1 + 2 sum rho(k) of an even series, 1 to n: its n values
/// tell of their mean as n / tau independent ones do. rho is taken about `mean`, the value that is
/// expected, and up to where rho(k) + rho(k + 1) is not positive any more [Geyer1992, sec. 3.3].
double AutocorrelationTime(const std::vector<double>& series, double mean);

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

/// How a series of rms values comes to its steady level; NaN if there are fewer than 40 values.
struct Settling {
  double level;  ///< the median of the last half
  /// The number, from 1, of the first value from which on the centred rms stays within 20 % of the
  /// level; infinity if it is outside at the end. The centred rms of value i is that of the values
  /// i - r to i + r, r = min(i - 1, 4). The last four values have none of their own.
  double count;
};
/// When a series of rms values, one for each frame say, has settled.
Settling SettlingOf(const std::vector<double>& rms);

}  // namespace alidade
