// SPDX-License-Identifier: Apache-2.0
#include "console.h"

#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <system_error>

#include "alidade/base/error.h"
#include "alidade/io/utf8.h"
#include "excerpt.h"

namespace alidade::cli {
namespace {

std::atomic<bool> stop_requested{false};
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler sets stop_requested");

/// Requests a stop at the first signal. The second signal ends the process.
extern "C" void HandleStop(int signal_number) {
  if (!stop_requested.exchange(true)) return;
  ::signal(signal_number, SIG_DFL);
  ::raise(signal_number);
}

/// Writes the whole text. Returns false and sets errno on failure.
bool WriteAll(int fd, std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = ::write(fd, text.data(), text.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return false;
    text.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

/// Returns `text` with `?` for each control character except line ends and tabs. A terminal would
/// obey control characters.
std::string Sanitise(std::string_view text) { return internal::PrintableUtf8(text, "\n\t"); }

/// Writes to standard error. Ignores a failure, because there is no other place to report it.
void WriteError(std::string_view text) { static_cast<void>(WriteAll(STDERR_FILENO, text)); }

bool IsSet(const char* variable) {
  const char* value = std::getenv(variable);
  return value != nullptr && *value != '\0';
}

/// Returns true if standard error is a terminal that can move its cursor.
bool IsTerminal() {
  const char* terminal = std::getenv("TERM");
  const bool dumb = terminal == nullptr || std::strcmp(terminal, "dumb") == 0;
  return !dumb && ::isatty(STDERR_FILENO) == 1;
}

bool SupportsColour() { return IsTerminal() && !IsSet("NO_COLOR"); }

/// Returns `label: `. The label has the colour `colour` if `coloured` is true.
std::string FormatLabel(const char* label, const char* colour, bool coloured) {
  const std::string text = std::string(label) + ':';
  return (coloured ? "\033[1;" + std::string(colour) + 'm' + text + "\033[0m" : text) + ' ';
}

/// State of the progress line. Messages from all threads are printed above this line.
std::mutex progress_mutex;
std::size_t progress_width = 0;

/// Removes the progress line from the terminal. The mutex must be locked.
void ClearProgress() {
  if (progress_width > 0) WriteError('\r' + std::string(progress_width, ' ') + '\r');
  progress_width = 0;
}

void WriteMessage(LogLevel level, std::string_view text, bool coloured) {
  const char* const colour = level == LogLevel::kError     ? "31"
                             : level == LogLevel::kWarning ? "33"
                                                           : "36";
  const std::lock_guard lock(progress_mutex);
  ClearProgress();
  WriteError(FormatLabel(ToString(level), colour, coloured) + Sanitise(text) + '\n');
}

}  // namespace

void PrepareConsole() {
  ::signal(SIGPIPE, SIG_IGN);
  ::signal(SIGXFSZ, SIG_IGN);
}

std::string ShellQuoted(const std::string& text) {
  constexpr const char* kPlain =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789"
      "%+,-./:=@_";
  if (!text.empty() && text.find_first_not_of(kPlain) == text.npos) return text;
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + '\'';
}

void Print(std::string_view text) {
  if (WriteAll(STDOUT_FILENO, text)) return;
  const std::string reason = std::generic_category().message(errno);
  throw Error(ExitCode::kIo, "<stdout>: cannot write: " + reason);
}

void PrintErrors(std::string_view text) {
  const bool colour = SupportsColour();
  std::string lines, last_excerpt;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (line.empty()) continue;
    const bool is_continued = line[0] == ' ';
    if (!is_continued) lines += FormatLabel("error", "31", colour);
    lines.append(Sanitise(line)).append("\n");
    const std::string excerpt = is_continued ? "" : Excerpt(line);
    if (excerpt != last_excerpt) lines += Sanitise(excerpt);
    last_excerpt = excerpt;
  }
  WriteError(lines);
}

void PrintNote(std::string_view text) { WriteError(Sanitise(text) + '\n'); }

void ShowLog(LogLevel minimum_level) {
  static const LogSubscription terminal(
      minimum_level, [coloured = SupportsColour()](LogLevel level, std::string_view text) {
        WriteMessage(level, text, coloured);
      });
}

Progress::Progress(const char* unit, bool quiet) : unit_(unit), enabled_(!quiet && IsTerminal()) {}

void Progress::Show(std::int64_t done, std::int64_t total) {
  if (!enabled_) return;
  const auto now = std::chrono::steady_clock::now();
  if (now < next_) return;
  next_ = now + std::chrono::milliseconds(100);
  std::string line = std::to_string(done);
  if (total > 0) line += " of " + std::to_string(total);
  line.append(" ").append(unit_);
  if (total > 0) line += ", " + std::to_string(100 * done / total) + " %";
  // If the previous line was longer, blanks overwrite its end. Escape sequences are not needed.
  const std::lock_guard lock(progress_mutex);
  const std::size_t width = line.size();
  if (width < progress_width) line.append(progress_width - width, ' ');
  progress_width = width;
  WriteError('\r' + line);
}

void Progress::Clear() {
  const std::lock_guard lock(progress_mutex);
  ClearProgress();
}

void StopOnSignals() {
  struct sigaction action {};
  action.sa_handler = HandleStop;
  sigemptyset(&action.sa_mask);
  action.sa_flags = 0;  // without SA_RESTART, a signal interrupts a read that waits for data
  ::sigaction(SIGINT, &action, nullptr);
  ::sigaction(SIGTERM, &action, nullptr);
  struct sigaction hangup {};
  ::sigaction(SIGHUP, nullptr, &hangup);
  if (hangup.sa_handler != SIG_IGN) ::sigaction(SIGHUP, &action, nullptr);  // nohup ignores SIGHUP
}

bool StopRequested() { return stop_requested; }

}  // namespace alidade::cli
