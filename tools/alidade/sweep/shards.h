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

/// A merged sweep, equal to the result of one process that executes all runs.
struct MergedSweep {
  Config config;
  std::string inputs;                  ///< the text of inputs.json
  std::optional<Variation> variation;  ///< nullopt: no key is varied
  std::vector<SweepResult> results;    ///< by value; one entry if no key is varied
};

/// Reads the folders of all shards of one sweep, in any order. Errors: kInputMissing if a folder or
/// a file in it is missing. kBadData if a folder is not that of a finished shard; if its config,
/// options, build or data differ from those of the first; if a shard is given twice or is missing;
/// or if a shard lacks a run.
MergedSweep MergeShards(const std::vector<std::filesystem::path>& folders);

}  // namespace alidade::internal
