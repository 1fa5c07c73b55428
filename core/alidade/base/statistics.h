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

}  // namespace alidade
