// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "alidade/base/output_folder.h"
#include "alidade/resume/leftovers.h"
#include "alidade/sweep/sweep.h"

namespace alidade::internal {

/// The finished runs of a sweep that is not finished itself, in `finished_runs.jsonl` of its
/// folder: a sweep that resumes it takes them from there.
class FinishedRuns {
 public:
  /// Creates the file in `folder`, with what is in those of `before`. Errors: kBadData with the
  /// line, kCannotCreate, kIo.
  FinishedRuns(OutputFolder& folder, const std::vector<std::filesystem::path>& before);

  struct Known {
    SweepRun run;
    Place place;  ///< where it was read
  };
  /// Null: it was not finished before.
  const Known* Find(const std::string& value, std::uint64_t seed) const;
  /// How many were.
  std::size_t size() const { return known_.size(); }
  /// Adds the RunLine() of a run that came to its end; the folder is worth keeping from now on.
  /// From any thread: one that writes already writes it too, so that none waits for another. After
  /// an error nothing is written any more. Errors: kCannotCreate, kIo.
  void Add(std::string line);
  /// Error: kIo.
  void Close() { file_->Close(); }

 private:
  void Read(const std::filesystem::path& file);

  OutputFolder& folder_;
  std::map<std::pair<std::string, std::uint64_t>, Known> known_;
  std::mutex mutex_;                  ///< of the two below
  std::vector<std::string> waiting_;  ///< lines to be written
  bool writing_ = false;              ///< a thread is in Add that writes them, or failed there
  std::unique_ptr<OutputFile> file_;
};

}  // namespace alidade::internal
