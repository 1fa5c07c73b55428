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

/// Writes `text` to standard output. If the reader has closed the pipe, requests a stop, and this
/// and all later texts are lost without an error. Error: kIo if a byte cannot be written.
void Print(std::string_view text);
/// Returns true if the reader of standard output has closed the pipe.
bool OutputClosed();

/// Returns the width of a line on standard output: that of the terminal, else the variable COLUMNS,
/// else internal::kDefaultTextWidth. The result is limited to 60 to 200.
std::size_t OutputWidth();
/// Prints text for a person: wraps its lines to OutputWidth() and, on a terminal, colours verdicts,
/// the words of `check` and `doctor`, and numbers that are marked by ` !`. Errors: those of Print.
void PrintText(std::string_view text);

/// Formats a duration: `0.35 s`, `83 s`, `12 min`, `3.4 h`.
std::string DurationText(double s);

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

/// Progress line of a command, printed on standard error: the number of units that are done, the
/// rate and the time left. Nothing is printed if standard error is not a terminal, or if `quiet` is
/// true. Threads must not call it at the same time.
class Progress {
 public:
  Progress(const char* unit, bool quiet);
  ~Progress() { Clear(); }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Shows the progress. `total` is negative if it is unknown.
  void Show(std::int64_t done, std::int64_t total) { Show(done, total, unit_); }
  /// Shows the progress of a part of the command, which has other units.
  void Show(std::int64_t done, std::int64_t total, const char* unit);
  /// Shows that a step takes long: adds its duration to the line. Called during the step.
  void Tick();
  void Clear();

 private:
  using Clock = std::chrono::steady_clock;

  void Write(std::string line);

  const char* unit_;
  bool enabled_;
  Clock::time_point begin_ = Clock::now(), next_ = {}, shown_ = Clock::now();
  std::string line_;
};

/// Installs a handler for SIGINT, SIGTERM and SIGHUP. An ignored SIGHUP remains ignored. The first
/// signal requests that the command stop, and prints `answer` if standard error is a terminal. A
/// second signal ends the process at once.
void StopOnSignals(const char* answer = "finishing the current frame");
bool StopRequested();

}  // namespace alidade::cli
