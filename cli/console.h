// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>

#include "alidade/io/log.h"

namespace alidade::cli {

/// A write to a closed pipe, or beyond the size limit of a file, becomes an error instead of a
/// signal that ends the process.
void PrepareConsole();

/// Writes to standard output, every byte checked. Error: kIo.
void Print(std::string_view text);

/// `error: LINE` on standard error for each line; a line that is indented continues the one above.
/// Control characters and bytes that are not UTF-8, as a file may hold them, are shown as `?`; in
/// notes too.
void PrintErrors(std::string_view text);
void PrintNote(std::string_view text);

/// From now on messages of the log, of level `least` and above, are lines `LEVEL: TEXT` on standard
/// error, the level in colour on a terminal.
void ShowLog(LogLevel least);

/// A line on the terminal of standard error that says how far a command is; nothing where that is
/// no terminal, or where `quiet`.
class Progress {
 public:
  Progress(const char* unit, bool quiet);
  ~Progress() { Clear(); }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// `total` < 0: not known.
  void Show(std::int64_t done, std::int64_t total);
  void Clear();

 private:
  const char* unit_;
  bool enabled_;
  std::chrono::steady_clock::time_point next_;
};

/// From now on SIGINT, SIGTERM and, unless it is ignored, SIGHUP request the command to stop; a
/// second one ends the process at once.
void StopOnSignals();
bool StopRequested();

}  // namespace alidade::cli
