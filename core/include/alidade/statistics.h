// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

namespace alidade {

/// Quantile q, in [0, 1], of chi-square with `dof` > 0 degrees of freedom.
double ChiSquareQuantile(double q, int dof);

/// Delay of `signal` after `reference`, both sampled every `step`, in the unit of step: the shift
/// k, |k| <= min(n/4, 2000), with the largest correlation coefficient over the n - |k| samples
/// that overlap, refined by a parabola. On a ramp, where `reference` correlates with itself by more
/// than 0.9 at every such k, that tells nothing: there it is the k with the least mean of
/// (signal(i + k) - reference(i))^2, and an offset counts as delay. NaN where one of them is
/// constant, the best k lies at the edge or is no better than its neighbours, or n < 8.
double Lag(const std::vector<double>& signal, const std::vector<double>& reference, double step);

}  // namespace alidade
