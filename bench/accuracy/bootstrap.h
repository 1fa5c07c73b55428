// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "alidade/base/random.h"
#include "alidade/base/statistics.h"

namespace alidade::bench {

/// Returns the 95 % bootstrap interval of the mean of n independent values [Efron1993, ch. 13]. The
/// ends of the interval are the 2.5 and 97.5 % quantiles of the means of `draws` samples of n
/// values, drawn with replacement. For differences of two methods on the same series, this is the
/// paired bootstrap over the series. For small n the interval is too narrow, by a factor of about
/// sqrt((n - 1) / n).
inline Interval BootstrapOfMean(const std::vector<double>& values, int draws = 20000,
                                std::uint64_t seed = 1) {
  Random random(seed);
  std::vector<double> means(draws);
  const double n = static_cast<double>(values.size());
  for (double& mean : means) {
    mean = 0.0;
    for (std::size_t i = 0; i < values.size(); ++i) {
      mean += values[static_cast<std::size_t>(random.Uniform() * n)] / n;
    }
  }
  std::ranges::sort(means);
  return {Quantile(means, 0.025), Quantile(means, 0.975)};
}

}  // namespace alidade::bench
