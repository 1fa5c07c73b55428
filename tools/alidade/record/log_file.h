// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "alidade/io/log.h"
#include "alidade/io/output_folder.h"

namespace alidade::internal {

/// `log.txt` of a run folder: a line `LEVEL: TEXT` for each message of level info and above, of the
/// thread that made it alone, so that runs in parallel have a log each. A run goes on without it:
/// if it cannot be written, a warning says so.
class LogFile {
 public:
  explicit LogFile(const OutputFolder& folder);
  /// Writes what is buffered; later messages are left out.
  void Close();

 private:
  void Take(LogLevel level, std::string_view text);
  void GiveUp(const Error& error);

  const std::thread::id thread_ = std::this_thread::get_id();
  std::unique_ptr<OutputFile> file_;  ///< null: closed, or it could not be written
  std::string failure_;               ///< why it could not be
  std::optional<LogSubscription> subscription_;
};

}  // namespace alidade::internal
