// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "alidade/io/log.h"

namespace alidade::cli {

/// Ignores SIGPIPE and SIGXFSZ. A write to a closed pipe, or beyond the size limit of a file, then
/// reports an error instead of ending the process.
void PrepareConsole();

/// Writes `text` to standard output. Error: kIo if a byte cannot be written.
void Print(std::string_view text);

/// Writes a page to a file. Errors: kCannotCreate, kIo.
void WritePageFile(const std::filesystem::path& file, std::string_view page);
/// Returns an empty line and the line `report   PAGE`, the last line of a command that has written
/// a page. PAGE is `path`, or `report.html` in it if `path` is a folder.
std::string ReportLine(std::filesystem::path path);

/// Prints `error: LINE` on standard error for each line. An indented line continues the line above.
/// Each line that begins with a place in a file is followed by its Excerpt(), unless the line
/// before it has the same excerpt.
/// PrintErrors and PrintNote print `?` for each control character and each byte that is not UTF-8.
void PrintErrors(std::string_view text);
void PrintNote(std::string_view text);

/// Prints each later log message of level `minimum_level` or above on standard error, as a line
/// `LEVEL: TEXT`. The level is in colour on a terminal.
void ShowLog(LogLevel minimum_level);

/// Progress line of a command, printed on standard error. Nothing is printed if standard error is
/// not a terminal, or if `quiet` is true.
class Progress {
 public:
  Progress(const char* unit, bool quiet);
  ~Progress() { Clear(); }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Shows the progress. `total` is negative if it is unknown.
  void Show(std::int64_t done, std::int64_t total);
  void Clear();

 private:
  const char* unit_;
  bool enabled_;
  std::chrono::steady_clock::time_point next_;
};

/// Installs a handler for SIGINT, SIGTERM and SIGHUP. An ignored SIGHUP remains ignored. The first
/// signal requests that the command stop. A second signal ends the process at once.
void StopOnSignals();
bool StopRequested();

}  // namespace alidade::cli
