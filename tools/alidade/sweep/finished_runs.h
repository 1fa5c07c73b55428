// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "alidade/io/output_folder.h"
#include "alidade/sweep/sweep.h"

namespace alidade::internal {

/// Name of the file with the RunLine() of each finished run of a sweep. In `FOLDER.partial` the
/// lines are in the order in which the runs finished. In the folder of a shard, the lines are
/// sorted by value and seed, and include failed runs.
constexpr const char* kFinishedRuns = "finished_runs.jsonl";

/// File kFinishedRuns of a folder to which a sweep is being written.
class FinishedRuns {
 public:
  /// Opens the file and reads the runs that an earlier sweep recorded. Removes an incomplete last
  /// line. Errors: kBadData with the line, kCannotCreate, kIo.
  explicit FinishedRuns(OutputFolder& folder);

  /// Returns a run of the earlier sweep, or null if that sweep did not record the run.
  const SweepRun* Find(const std::string& value, std::uint64_t seed) const;
  /// Returns the number of runs of the earlier sweep.
  std::size_t size() const { return runs_.size(); }
  /// Appends a run to the file. May be called from any thread. Error: kIo.
  void Add(const std::string& value, const SweepRun& run);
  /// Closes the file. Error: kIo.
  void Close() { file_->Close(); }

 private:
  OutputFolder& folder_;
  /// Runs of the earlier sweep, by value and seed.
  std::map<std::pair<std::string, std::uint64_t>, SweepRun> runs_;
  std::mutex mutex_;
  std::unique_ptr<OutputFile> file_;
};

}  // namespace alidade::internal
