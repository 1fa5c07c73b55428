// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/log_file.h"

#include <utility>

namespace alidade::internal {

LogFile::LogFile(const OutputFolder& folder) {
  try {
    file_ = folder.Create("log.txt");
  } catch (const Error& error) {
    Log(LogLevel::kWarning, std::string(error.what()) + "; the run continues without a log");
    return;
  }
  subscription_.emplace(LogLevel::kInfo,
                        [this](LogLevel level, std::string_view text) { Record(level, text); });
}

void LogFile::Record(LogLevel level, std::string_view text) {
  if (file_ == nullptr || std::this_thread::get_id() != thread_) return;
  try {
    file_->Write(std::string(ToString(level)) + ": " + std::string(text) + '\n');
  } catch (const Error& error) {
    RecordFailure(error);
  }
}

void LogFile::RecordFailure(const Error& error) {
  failure_ = error.what();
  file_.reset();
}

void LogFile::Close() {
  subscription_.reset();
  try {
    if (file_ != nullptr) file_->Close();
    file_.reset();
  } catch (const Error& error) {
    RecordFailure(error);
  }
  const std::string failure = std::exchange(failure_, {});
  if (!failure.empty()) Log(LogLevel::kWarning, failure + "; the run continues without a log");
}

}  // namespace alidade::internal
