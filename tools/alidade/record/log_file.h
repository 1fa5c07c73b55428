// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "alidade/io/log.h"
#include "alidade/io/output_folder.h"

namespace alidade::internal {

/// Writer of `log.txt` in a run folder: a line `LEVEL: TEXT` for each message of level info or
/// above. It records only messages of the thread that created the LogFile, so parallel runs have
/// separate logs. If the file cannot be written, a warning reports the failure, and the run
/// continues.
class LogFile {
 public:
  explicit LogFile(const OutputFolder& folder);
  /// Closes the file. Later messages are not recorded. If a write has failed, logs a warning.
  void Close();

 private:
  void Record(LogLevel level, std::string_view text);
  void RecordFailure(const Error& error);

  const std::thread::id thread_ = std::this_thread::get_id();
  std::unique_ptr<OutputFile> file_;  ///< null: the file is closed, or a write has failed
  std::string failure_;               ///< message of the failed write; "": no failure
  std::optional<LogSubscription> subscription_;
};

}  // namespace alidade::internal
