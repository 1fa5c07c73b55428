// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace alidade {

/// Returns the q-quantile of the chi-square distribution with `dof` > 0 degrees of freedom. q is in
/// [0, 1].
double ChiSquareQuantile(double q, double dof);

/// Returns the mean of chi2(dof) / dof, truncated at chi2(dof) <= cut. A gate with the threshold
/// `cut` accepts only measurements with r' S^-1 r <= cut.
double TruncatedMean(double dof, double cut);

/// Closed interval.
struct Interval {
  double low, high;
};

/// Returns the interval that contains the mean of n independent samples of chi2(dof) / dof with
/// probability 0.95 [BarShalom2001, sec. 5.4]. The interval applies to the mean NEES or NIS of a
/// consistent filter. n need not be an integer.
///
///   [low, high] = m chi2(p, nu) / nu,   p = 0.025, 0.975,   nu = 2 n m^2 / v
///
/// m and v are the mean and variance of one sample. Without a gate, m = 1, v = 2 / dof, and
/// nu = n dof. With a gate, the chi-square distribution is truncated at `cut`: the gate accepts
/// only measurements with r' S^-1 r <= cut (not divided by dof).
Interval ConsistencyBounds(double dof, double n,
                           double cut = std::numeric_limits<double>::infinity());

/// Result of TestScale.
enum class ScaleTest { kPassed, kTooLarge, kTooSmall };
/// Tests whether the mean of n independent values of chi2(dof) / dof, such as NEES / dof, may be 1.
/// The mean is too large if it exceeds chi2(1 - p, nu) / nu, nu = n dof, and is at least 1.15^2. It
/// is too small if it is below chi2(p, nu) / nu and at most 1.15^-2. n need not be an integer. The
/// probability of a false alarm is 2 p.
ScaleTest TestScale(double mean, double dof, double n, double p = 8e-7);

/// Returns the 95 % interval of a probability p, of which k successes in n > 0 trials are known
/// [Wilson1927]. With z = 1.96 and f = k / n:
///
///   (f + z^2 / 2n +- z sqrt(f (1 - f) / n + z^2 / 4n^2)) / (1 + z^2 / n)
Interval ShareInterval(std::int64_t successes, std::int64_t trials);

/// Returns the q-quantile of the ascending values x[0..n-1], n > 0. q is in [0, 1]. Interpolates
/// linearly between the values (type 7 of Hyndman and Fan):
///
///   x[k] + (h - k) (x[k + 1] - x[k]),   h = (n - 1) q,   k = floor h
double Quantile(const std::vector<double>& ascending, double q);

/// Returns the median. `values` must not be empty.
double Median(std::vector<double> values);
/// Returns the mean. `values` must not be empty.
double Mean(std::span<const double> values);
/// Returns the sum of squared deviations from the mean. `values` must not be empty.
double SquaredDeviation(std::span<const double> values);

/// Mean and quantiles of a set of values. p05, p50 and p95 are the 5 %, 50 % and 95 % quantiles.
struct Spread {
  double mean = 0.0, p05 = 0.0, p50 = 0.0, p95 = 0.0;
  std::size_t count = 0;  ///< number of values that are not NaN
};
/// Returns the spread of the values that are not NaN. Without such values, the mean and quantiles
/// are NaN.
Spread SpreadOf(std::vector<double> values);

}  // namespace alidade
