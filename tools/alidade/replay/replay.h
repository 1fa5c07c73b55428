// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "alidade/replay/run_inputs.h"

/// Comparison of a run folder with a second folder that was computed from the recorded inputs of
/// the first.
namespace alidade::internal {

struct FileDifference {
  std::string file;  ///< path relative to the folder
  /// Position of the first difference. 0: the whole file differs.
  std::int64_t line = 0, column = 0;
  std::string description;  ///< description, as in `now '0.51', was '0.5'`
};

struct ReplayResult {
  std::int64_t files = 0;                 ///< number of compared files
  std::vector<std::string> not_compared;  ///< files that contain wall-clock times
  std::vector<std::string> inputs;        ///< result of InputDifferences()
  std::vector<FileDifference> differences;

  bool equal() const { return inputs.empty() && differences.empty(); }
};

/// Returns `status` from the run.json or sweep.json of a folder. Returns "" if there is no status.
/// Error: kBadData.
std::string RecordedStatus(const std::filesystem::path& folder);

/// Reads the inputs of `folder`. Errors: kInputMissing if the folder does not contain inputs.json,
/// or if the data came from a pipe; kBadData if the run or sweep is unfinished.
RecordedInputs ReadReplayable(const std::filesystem::path& folder);

/// Returns true if a file of a run folder contains wall-clock times, which differ in every run.
bool HasWallClock(std::string_view file);

/// Compares all files of two folders, except files with wall-clock times (HasWallClock()).
ReplayResult CompareReplay(const std::filesystem::path& recorded,
                           const std::filesystem::path& current);

/// Formats the result as JSON.
std::string ReplayJson(const ReplayResult& result);
/// Formats the result for a terminal. `folder` is the path as the user wrote it.
std::string ReplayText(const ReplayResult& result, const std::string& folder);

}  // namespace alidade::internal
