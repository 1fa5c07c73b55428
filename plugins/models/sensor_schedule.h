// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "alidade/base/random.h"
#include "alidade/config/config.h"

namespace alidade::models {

/// Schedule of a simulated sensor: its time steps, missing measurements and outliers.
struct Schedule {
  struct Outcome {
    bool missing;
    double sigma_scale;  ///< factor of the noise; 1 if the measurement is not an outlier
  };

  /// Returns true if the sensor measures at time step `index`.
  bool IsDue(std::int64_t index) const {
    const auto count = [&](std::int64_t k) {
      return static_cast<std::int64_t>(static_cast<double>(k) * per_step * (1.0 + 1e-12));
    };
    return index == 0 || count(index) > count(index - 1);
  }
  Outcome Draw() {
    const bool is_missing = random.Uniform() < missing;
    const bool is_outlier = random.Uniform() < outliers;
    return {is_missing, is_outlier ? sigma_scale : 1.0};
  }

  double per_step = 1.0;  ///< measurements per time step, at most 1
  /// Known numbers of each measurement of one time step. A sensor without known numbers has one
  /// empty list.
  std::vector<std::vector<double>> known;
  double missing = 0.0, outliers = 0.0, sigma_scale = 1.0;
  Random random;
};

/// Reads the entry of a sensor: `rate_hz`, `missing` and `outliers: {share, sigma_scale}`. If
/// `known_size` is not 0, also reads `known`, a list with `known_size` numbers for each
/// measurement. Without an entry the sensor measures at each time step, `rate_hz` times per second.
/// Errors: kBadConfig.
inline Schedule ReadSchedule(const std::optional<Node>& entry, double rate_hz, int known_size,
                             std::uint64_t seed, std::uint64_t stream) {
  Schedule schedule{1.0, {}, 0.0, 0.0, 1.0, Random(seed, stream)};
  if (known_size == 0) schedule.known.emplace_back();
  if (!entry) return schedule;
  if (known_size > 0) {
    const Node known = entry->At("known", "a sensor with known numbers");
    for (const Node& row : known.Items()) schedule.known.push_back(row.Numbers(known_size));
    if (schedule.known.empty())
      known.Fail("the list is empty",
                 "a list of " + std::to_string(known_size) + " numbers for each measurement");
  }
  if (const auto sensor_rate = entry->Find("rate_hz")) {
    schedule.per_step = sensor_rate->Number(0.0, rate_hz, true) / rate_hz;
  }
  if (const auto missing = entry->Find("missing")) schedule.missing = missing->Number(0.0, 1.0);
  if (const auto outliers = entry->Find("outliers")) {
    schedule.outliers = outliers->At("share", "outliers").Number(0.0, 1.0);
    schedule.sigma_scale = outliers->At("sigma_scale", "outliers").Number(1.0, 1e9);
    outliers->RejectUnread();
  }
  entry->RejectUnread();
  return schedule;
}

}  // namespace alidade::models
