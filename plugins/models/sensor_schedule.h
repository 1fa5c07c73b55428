// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "alidade/base/random.h"
#include "alidade/config/config.h"

namespace alidade::models {

/// When a sensor of the simulation measures, and what becomes of its measurements.
struct Schedule {
  struct Fate {
    bool missing;
    double sigma_scale;  ///< of its noise; 1 unless it is an outlier
  };

  /// Whether it measures at time step `index`.
  bool IsDue(std::int64_t index) const {
    const auto count = [&](std::int64_t k) {
      return static_cast<std::int64_t>(static_cast<double>(k) * per_step * (1.0 + 1e-12));
    };
    return index == 0 || count(index) > count(index - 1);
  }
  Fate Draw() {
    const bool lost = random.Uniform() < missing;
    const bool outlier = random.Uniform() < outliers;
    return {lost, outlier ? sigma_scale : 1.0};
  }

  double per_step = 1.0;  ///< measurements to a time step, at most 1
  /// Of each measurement at one time step, the known numbers that come with it: none of most.
  std::vector<std::vector<double>> known;
  double missing = 0.0, outliers = 0.0, sigma_scale = 1.0;
  Random random;
};

/// Reads the entry of a sensor: `rate_hz`, `missing`, `outliers: {share, sigma_scale}`, and of one
/// that takes `known_size` known numbers `known`, a list of such lists; none: one measurement at
/// each of the `rate_hz` steps a second. Errors: kBadConfig.
inline Schedule ReadSchedule(const std::optional<Node>& entry, double rate_hz, int known_size,
                             std::uint64_t seed, std::uint64_t stream) {
  Schedule schedule{1.0, {}, 0.0, 0.0, 1.0, Random(seed, stream)};
  if (known_size == 0) schedule.known.emplace_back();
  if (!entry) return schedule;
  if (known_size > 0) {
    const Node known = entry->At("known", "a sensor that takes known numbers");
    for (const Node& row : known.Items()) schedule.known.push_back(row.Numbers(known_size));
    if (schedule.known.empty())
      known.Fail("empty",
                 "a list of " + std::to_string(known_size) + " numbers for each measurement");
  }
  if (const auto own = entry->Find("rate_hz")) {
    schedule.per_step = own->Number(0.0, rate_hz, true) / rate_hz;
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
