// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "alidade/sweep/sweep.h"

/// The configs of a sweep's runs.
namespace alidade::internal {

/// Refuses a source that is empty for whoever reads it a second time, as `reader` says: standard
/// input, or a pipe. Error: kBadConfig.
void CheckReadableAgain(const Config& config,
                        const char* reader = "a sweep reads it for every run");

/// Whether the source of `config` gives other data for `seed` than for the next one: reads both up
/// to their first difference. A source whose data have an error counts as one that does.
bool UsesSeed(const Config& config, const PluginHost& host, std::uint64_t seed);

/// Says that it does not. Error: kBadConfig.
[[noreturn]] void FailUnseeded(const Config& config);

/// Seeds that count up from the first.
struct SeedRange {
  std::uint64_t first = 1;
  std::int64_t count = 1;
};

/// Those of a share of `runs` seeds from `first_seed` on: of share i from floor(runs (i - 1) / of)
/// to floor(runs i / of), so that no two shares differ by more than one.
SeedRange SeedsOf(const Shard& shard, std::uint64_t first_seed, std::int64_t runs);

/// As Sweep(), for data that depend on the seed or not.
SweepResult SweepSeeds(const Config& config, const PluginHost& host, const SweepOptions& options);

}  // namespace alidade::internal
