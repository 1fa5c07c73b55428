// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

/// Statistics of time series.
namespace alidade {

/// Computes the integrated autocorrelation time tau = 1 + 2 sum rho(k) of an evenly sampled series,
/// from 1 to n. The mean of n such values is as certain as the mean of n / tau independent values.
/// rho is the autocorrelation about the expected value `mean`. The sum ends before the first pair
/// with rho(k) + rho(k + 1) <= 0 [Geyer1992, sec. 3.3].
double AutocorrelationTime(const std::vector<double>& series, double mean);

/// Computes the delay of `signal` after `reference`, both sampled every `step`. The result has the
/// unit of `step`. The delay is the shift k, |k| <= min(n/4, 2000), with the largest correlation
/// coefficient over the n - |k| overlapping samples, refined by a parabola.
///
/// A `reference` is a ramp if its correlation with itself exceeds 0.9 at every such k. All
/// coefficients are then similar, so the delay is the k with the smallest mean of (signal(i + k) -
/// reference(i))^2. An offset then counts as delay.
///
/// Returns NaN if one series is constant, if the best k lies at the edge or does not exceed its
/// neighbours, or if n < 8.
double Lag(const std::vector<double>& signal, const std::vector<double>& reference, double step);

/// Settling of a series of rms values to its steady level; NaN for fewer than 40 values.
struct Settling {
  double level;  ///< median of the second half
  /// Number, counted from 1, of the value from which the centred rms stays within 20 % of the
  /// level. Infinite if the last centred rms is outside this band. The centred rms of value i
  /// covers the values i - r to i + r, r = min(i - 1, 4). The last four values do not have a
  /// centred rms.
  double count;
};
/// Computes the settling of a series of rms values, for example one per frame.
Settling SettlingOf(const std::vector<double>& rms);

}  // namespace alidade
