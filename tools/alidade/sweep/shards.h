// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "alidade/config/config.h"
#include "alidade/sweep/sweep.h"

/// The shards of one sweep, put together.
namespace alidade::internal {

/// A sweep, as one process would have made it.
struct MergedSweep {
  Config config;
  std::string inputs;                  ///< the text of inputs.json
  std::optional<Variation> variation;  ///< none: no key is varied
  std::vector<SweepResult> results;    ///< by value; one where none is varied
};

/// Reads the folders of all shards of one sweep, in any order. Errors: kInputMissing where a folder
/// or a file of it is missing; kBadData where one is not that of a finished shard, or of another
/// sweep than the first: of another config, other options, another build or data; where a shard
/// comes twice or is missing, or lacks a run.
MergedSweep MergeShards(const std::vector<std::filesystem::path>& folders);

}  // namespace alidade::internal
