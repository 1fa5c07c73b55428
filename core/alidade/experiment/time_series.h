// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

/// Statistics of values that follow one another in time.
namespace alidade {

/// Integrated autocorrelation time tau = 1 + 2 sum rho(k) of an even series, 1 to n: its n values
/// tell of their mean as n / tau independent ones do. rho is taken about `mean`, the value that is
/// expected, and up to where rho(k) + rho(k + 1) is not positive any more [Geyer1992, sec. 3.3].
double AutocorrelationTime(const std::vector<double>& series, double mean);

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
