// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "alidade/config/config.h"
#include "alidade/sweep/sweep.h"

/// Merging of the shards of one sweep.
namespace alidade::internal {

/// Merged sweep. It equals the result of one process that executes all runs.
struct MergedSweep {
  Config config;
  std::string inputs;                  ///< text of inputs.json
  std::optional<Variation> variation;  ///< nullopt: no key is varied
  std::vector<SweepResult> results;    ///< one for each value; one entry if no key is varied
  std::string warning = {};            ///< as in VariedSweep
};

/// Reads the folders of all shards of one sweep, in any order. Errors: kInputMissing if a folder or
/// a file in a folder is missing; kBadData in these cases:
///
///   - a folder is not the folder of a finished shard
///   - the config, options, build or data of a shard differ from those of the first shard
///   - a shard is given twice or is missing
///   - a run is missing in a shard
MergedSweep MergeShards(const std::vector<std::filesystem::path>& folders);

}  // namespace alidade::internal
