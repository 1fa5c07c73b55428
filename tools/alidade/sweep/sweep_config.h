// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "alidade/sweep/sweep.h"

/// Configs and seeds of the runs of a sweep.
namespace alidade::internal {

/// Refuses a source that can be read only once: standard input or a pipe. In the message, `reader`
/// explains why the source is read again. Error: kBadConfig.
void CheckReadableAgain(const Config& config,
                        const char* reader = "a sweep reads the source for every run");

/// Returns true if both sources have equal data, including truth. Reads the data up to the first
/// difference. Errors: those of Source::Next.
bool HaveEqualData(Source& a, Source& b);

/// Returns true if the data of the source depend on the seed. Compares the data of `seed` with
/// those of the next seed. If an error occurs while the data are read, returns true.
bool UsesSeed(const Config& config, const PluginHost& host, std::uint64_t seed);

/// Throws kBadConfig for a source whose data do not depend on the seed.
[[noreturn]] void FailUnseeded(const Config& config);

/// Range of consecutive seeds.
struct SeedRange {
  std::uint64_t first = 1;
  std::int64_t count = 1;
};

/// Returns the seeds of a shard. All shards together have `runs` seeds that start at `first_seed`.
/// Shard i of n has the offsets from floor(runs (i - 1) / n) up to, but not including,
/// floor(runs i / n). The sizes of two shards differ by at most one.
SeedRange SeedsOf(const Shard& shard, std::uint64_t first_seed, std::int64_t runs);

/// Executes a sweep like Sweep(), but does not require that the data depend on the seed.
SweepResult SweepSeeds(const Config& config, const PluginHost& host, const SweepOptions& options);

}  // namespace alidade::internal
