// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>

#include "alidade/io/log.h"

namespace alidade::cli {

/// Turns a write to a closed pipe, or beyond the size limit of a file, into an error instead of a
/// signal that ends the process.
void PrepareConsole();

/// Writes `text` to standard output. Error: kIo if a byte cannot be written.
void Print(std::string_view text);

/// Prints `error: LINE` on standard error for each line. An indented line continues the line above.
/// Prints `?` for control characters and for bytes that are not UTF-8; PrintNote does the same.
void PrintErrors(std::string_view text);
void PrintNote(std::string_view text);

/// Prints each later log message of level `minimum_level` or above on standard error, as a line
/// `LEVEL: TEXT`. The level is in colour on a terminal.
void ShowLog(LogLevel minimum_level);

/// Progress line of a command on the terminal of standard error. It is not printed if standard
/// error is not a terminal, or if `quiet`.
class Progress {
 public:
  Progress(const char* unit, bool quiet);
  ~Progress() { Clear(); }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// `total` is negative if it is unknown.
  void Show(std::int64_t done, std::int64_t total);
  void Clear();

 private:
  const char* unit_;
  bool enabled_;
  std::chrono::steady_clock::time_point next_;
};

/// Installs handlers for SIGINT, SIGTERM and, unless it is ignored, SIGHUP. The first signal
/// requests a stop of the command; a second one ends the process at once.
void StopOnSignals();
bool StopRequested();

}  // namespace alidade::cli
