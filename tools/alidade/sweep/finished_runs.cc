// SPDX-License-Identifier: Apache-2.0
#include "alidade/sweep/finished_runs.h"

#include <filesystem>
#include <fstream>
#include <system_error>

#include "alidade/sweep/run_record.h"

namespace alidade::internal {

FinishedRuns::FinishedRuns(OutputFolder& folder) : folder_(folder) {
  const std::filesystem::path file = folder.partial() / kFinishedRuns;
  std::ifstream stream(file, std::ios::binary);
  Place place{file.string(), 0, 0};
  SharedNames names;
  std::uintmax_t complete_bytes = 0;  // size of the lines that have a line end
  for (std::string line; std::getline(stream, line) && !stream.eof();) {
    ++place.line;
    complete_bytes += line.size() + 1;
    std::optional<ParsedRunLine> parsed = ReadRunLine(line);
    if (!parsed) {
      throw Error(ExitCode::kBadData,
                  ErrorLine(place, {}, "the line is not the record of a run", "one run as JSON"));
    }
    const std::uint64_t seed = parsed->run.seed;
    parsed->run.ShareNames(names);
    runs_.try_emplace({parsed->value, seed}, std::move(parsed->run));
  }
  std::error_code error;
  if (stream.is_open()) std::filesystem::resize_file(file, complete_bytes, error);
  if (error) FailIo(file.string(), "write", error.value());
  file_ = folder.Append(kFinishedRuns);
}

const SweepRun* FinishedRuns::Find(const std::string& value, std::uint64_t seed) const {
  const auto found = runs_.find({value, seed});
  return found == runs_.end() ? nullptr : &found->second;
}

void FinishedRuns::Add(const std::string& value, const SweepRun& run) {
  const std::string line = RunLine(value, run);
  const std::lock_guard lock(mutex_);
  folder_.Retain();
  file_->Write(line);
  file_->Flush();  // flush now, because the next run may take hours
}

}  // namespace alidade::internal
