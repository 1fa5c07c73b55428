// SPDX-License-Identifier: Apache-2.0
#include "alidade/sweep/finished_runs.h"

#include <cerrno>
#include <fstream>
#include <utility>

#include "alidade/sweep/run_line.h"

namespace alidade::internal {

FinishedRuns::FinishedRuns(OutputFolder& folder, const std::vector<std::filesystem::path>& before)
    : folder_(folder) {
  for (const std::filesystem::path& one : before) Read(one / kFinishedRuns);
  file_ = folder.Create(kFinishedRuns);
  for (const auto& [key, known] : known_) file_->Write(RunLine(key.first, known.run));
  file_->Flush();
}

void FinishedRuns::Read(const std::filesystem::path& file) {
  std::ifstream stream(file);
  if (!stream && errno != ENOENT) FailIo(file.string(), "read", errno);
  Place place{file.string(), 0, 0};
  SharedNames names;
  for (std::string line; std::getline(stream, line);) {
    if (stream.eof()) return;  // cut short
    ++place.line;
    std::optional<LineOfRun> read = ReadRunLine(line);
    if (!read) {
      throw Error(ExitCode::kBadData, ErrorLine(place, {}, "is not what a sweep writes",
                                                "a run as JSON; leave out --resume"));
    }
    const std::uint64_t seed = read->run.seed;
    read->run.ShareNames(names);
    known_.try_emplace({read->value, seed}, Known{std::move(read->run), place});
  }
  if (stream.bad()) FailIo(file.string(), "read", EIO);
}

const FinishedRuns::Known* FinishedRuns::Find(const std::string& value, std::uint64_t seed) const {
  const auto found = known_.find({value, seed});
  return found == known_.end() ? nullptr : &found->second;
}

void FinishedRuns::Add(std::string line) {
  std::unique_lock lock(mutex_);
  waiting_.push_back(std::move(line));
  if (writing_) return;
  writing_ = true;
  while (!waiting_.empty()) {
    const std::vector<std::string> lines = std::exchange(waiting_, {});
    lock.unlock();
    if (!folder_.kept()) folder_.Keep();
    for (const std::string& one : lines) file_->Write(one);
    file_->Flush();  // the next may take hours
    lock.lock();
  }
  writing_ = false;
}

}  // namespace alidade::internal
