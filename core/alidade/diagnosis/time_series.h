// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

/// Statistics of time series.
namespace alidade {

/// Computes the integrated autocorrelation time tau = 1 + 2 sum rho(k) of an evenly sampled series
/// of n values. The result is between 1 and n. The mean of the n values is as certain as the mean
/// of n / tau independent values. rho is the autocorrelation about the expected value `mean`. The
/// sum ends before the first pair with rho(k) + rho(k + 1) <= 0 [Geyer1992, sec. 3.3].
double AutocorrelationTime(const std::vector<double>& series, double mean);

/// Returns the autocorrelation about the mean at a delay of one value.
double LagOneCorrelation(const std::vector<double>& series);

/// Computes the delay of `signal` relative to `reference`. Both series have n samples at intervals
/// of `step`, and the result has the unit of `step`. The delay is the shift k that maximises the
/// correlation coefficient of the n - |k| overlapping samples, for |k| <= min(n/4, 2000). A
/// parabola through the coefficients refines this k.
///
/// If the correlation of `reference` with itself exceeds 0.9 at every such k, `reference` is a
/// ramp. All coefficients are then similar. The delay of a ramp is therefore the k that minimises
/// the mean of (signal(i + k) - reference(i))^2. A constant offset of `signal` then appears as a
/// delay.
///
/// Returns NaN if n < 8, if `signal` is not finite, if a series is constant, or if the best k is
/// the smallest or largest k. Also returns NaN if the best k is not better than its neighbours.
double Lag(const std::vector<double>& signal, const std::vector<double>& reference, double step);

/// Settling of a series of rms values to a steady level. Both members are NaN if the series has
/// fewer than 40 values.
struct Settling {
  double level;  ///< median of the second half
  /// Number, counted from 1, of the value from which the centred rms stays within 20 % of the
  /// level. Infinite if the last centred rms is outside this band. The centred rms of value i
  /// covers the values i - r to i + r, with r = min(i - 1, 4). The last four values do not have a
  /// centred rms.
  double count;
};
/// Computes the settling of a series of rms values, for example one per frame.
Settling SettlingOf(const std::vector<double>& rms);

}  // namespace alidade
