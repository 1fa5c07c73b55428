// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "alidade/replay/run_inputs.h"

/// Whether a run folder and one that was made again from what it records are the same.
namespace alidade::internal {

struct FileDifference {
  std::string file;                   ///< relative to the folder
  std::int64_t line = 0, column = 0;  ///< of the first difference; 0: of the file as a whole
  std::string what;                   ///< `now '0.51', was '0.5'`
};

struct ReplayResult {
  std::int64_t files = 0;             ///< that were compared
  std::vector<std::string> left_out;  ///< files with the wall clock in them
  std::vector<std::string> inputs;    ///< as InputDifferences has them
  std::vector<FileDifference> differences;

  bool equal() const { return inputs.empty() && differences.empty(); }
};

/// `status` in the run.json or sweep.json of a folder; "" if there is none. Error: kBadData.
std::string RecordedStatus(const std::filesystem::path& folder);

/// What `folder` was made from. Errors: kInputMissing where it has no inputs.json, or its data came
/// from a pipe; kBadData where it is unfinished.
RecordedInputs ReadReplayable(const std::filesystem::path& folder);

/// Whether a file of a run folder has the wall clock in it, and so is another each time.
bool HasWallClock(std::string_view file);

/// Compares all files of the two but those that HasWallClock.
ReplayResult CompareReplay(const std::filesystem::path& before, const std::filesystem::path& now);

/// The result as JSON, and for a terminal, `folder` as it was named.
std::string ReplayJson(const ReplayResult& result);
std::string ReplayText(const ReplayResult& result, const std::string& folder);

}  // namespace alidade::internal
