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

/// The runs of a sweep that came to their end, the RunLine() of each: in `FOLDER.partial` in the
/// order in which they ended, in the folder of a shard by value and seed, with those that failed.
constexpr const char* kFinishedRuns = "finished_runs.jsonl";

/// The file of that name in a folder that is being written.
class FinishedRuns {
 public:
  /// Opens the file, and reads what an earlier sweep into this folder left; a last line that was
  /// cut short is removed. Errors: kBadData with the line, kCannotCreate, kIo.
  explicit FinishedRuns(OutputFolder& folder);

  /// Null if that run was not finished earlier.
  const SweepRun* Find(const std::string& value, std::uint64_t seed) const;
  /// Number of runs that were finished earlier.
  std::size_t size() const { return known_.size(); }
  /// Adds a run, from any thread. Error: kIo.
  void Add(const std::string& value, const SweepRun& run);
  /// Error: kIo.
  void Close() { file_->Close(); }

 private:
  OutputFolder& folder_;
  std::map<std::pair<std::string, std::uint64_t>, SweepRun> known_;
  std::mutex mutex_;
  std::unique_ptr<OutputFile> file_;
};

}  // namespace alidade::internal
