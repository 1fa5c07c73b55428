// SPDX-License-Identifier: Apache-2.0
#include "console.h"

#include <signal.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <system_error>

#include "alidade/base/error.h"
#include "alidade/base/number_text.h"
#include "alidade/diagnosis/verdict.h"
#include "alidade/io/output_file.h"
#include "alidade/io/utf8.h"
#include "alidade/io/wrap_text.h"
#include "excerpt.h"

namespace alidade::cli {
namespace {

std::atomic<bool> stop_requested{false};
std::atomic<bool> output_closed{false};
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler sets stop_requested");

/// Text that acknowledges the first signal on a terminal, or null.
const char* stop_answer = nullptr;

/// Requests a stop at the first signal, and acknowledges it. The second signal ends the process.
extern "C" void HandleStop(int signal_number) {
  if (!stop_requested.exchange(true)) {
    if (stop_answer == nullptr) return;
    const int error = errno;
    for (const char* text : {"\n", stop_answer, "; press Ctrl-C again to stop at once\n"}) {
      if (::write(STDERR_FILENO, text, std::strlen(text)) < 0) break;
    }
    errno = error;
    return;
  }
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

/// Returns true if the stream is a terminal that can move its cursor.
bool IsTerminal(int fd) {
  const char* terminal = std::getenv("TERM");
  const bool dumb = terminal == nullptr || std::strcmp(terminal, "dumb") == 0;
  return !dumb && ::isatty(fd) == 1;
}

bool SupportsColour(int fd) { return IsTerminal(fd) && !IsSet("NO_COLOR"); }

/// Returns the width of the terminal, else COLUMNS, else the width of text in files.
std::size_t WidthOf(int fd) {
  constexpr std::size_t kNarrowest = 60, kWidest = 200;
  winsize window{};
  std::size_t width = 0;
  if (::ioctl(fd, TIOCGWINSZ, &window) == 0) width = window.ws_col;
  const char* const columns = std::getenv("COLUMNS");
  if (width == 0 && columns != nullptr) width = std::strtoul(columns, nullptr, 10);
  if (width == 0) return internal::kDefaultTextWidth;
  return std::clamp(width, kNarrowest, kWidest);
}

constexpr const char *kRed = "31", *kYellow = "33", *kGreen = "32";

/// Returns the colour of a cell that is a verdict or the result of a check, or null.
const char* ColourOf(std::string_view cell) {
  if (cell.ends_with(" !") || cell == "FAIL" || cell == "fail") return kRed;
  if (cell == "warn") return kYellow;
  if (cell == "ok") return kGreen;
  const auto state = VerdictStateOf(cell);
  if (!state || *state == VerdictState::kNotTested) return nullptr;
  return *state == VerdictState::kConsistent       ? kGreen
         : *state <= VerdictState::kMostlyRejected ? kRed
                                                   : kYellow;
}

std::string InColour(std::string_view text, const char* colour) {
  return "\033[1;" + std::string(colour) + 'm' + std::string(text) + "\033[0m";
}

/// Colours the cells of all lines. Two or more blanks separate cells. A colon or a parenthesis ends
/// the verdict in a cell.
std::string Coloured(std::string_view text) {
  std::string coloured;
  while (!text.empty()) {
    const std::size_t cell_end = std::min({text.find("  "), text.find('\n'), text.size()});
    const std::string_view cell = text.substr(0, cell_end);
    const std::size_t size = std::min({cell.find(':'), cell.find(" ("), cell.size()});
    const char* const colour = ColourOf(cell.substr(0, size));
    coloured += colour != nullptr ? InColour(cell.substr(0, size), colour) : cell.substr(0, size);
    coloured += cell.substr(size);
    text.remove_prefix(cell_end);
    const std::size_t next = std::min(text.find_first_not_of(" \n"), text.size());
    coloured += text.substr(0, next);
    text.remove_prefix(next);
  }
  return coloured;
}

/// Wraps text for standard error if it is a terminal.
std::string Fitted(const std::string& text) {
  return IsTerminal(STDERR_FILENO) ? internal::WrapText(text, WidthOf(STDERR_FILENO)) : text;
}

/// Returns the line `label: text`. The label has the colour `colour` if `coloured` is true.
std::string MessageLine(const std::string& label, std::string_view text, const char* colour,
                        bool coloured) {
  const std::string line = Fitted(label + ": " + Sanitise(text)) + '\n';
  return coloured ? InColour(label + ':', colour) + line.substr(label.size() + 1) : line;
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
  const char* const colour = level == LogLevel::kError     ? kRed
                             : level == LogLevel::kWarning ? kYellow
                                                           : "36";
  const std::lock_guard lock(progress_mutex);
  ClearProgress();
  WriteError(MessageLine(ToString(level), text, colour, coloured));
}

}  // namespace

void PrepareConsole() {
  ::signal(SIGPIPE, SIG_IGN);
  ::signal(SIGXFSZ, SIG_IGN);
}

void Print(std::string_view text) {
  if (output_closed || WriteAll(STDOUT_FILENO, text)) return;
  if (errno == EPIPE) {
    output_closed = stop_requested = true;
    return;
  }
  const std::string reason = std::generic_category().message(errno);
  throw Error(ExitCode::kIo, "<stdout>: cannot write: " + reason);
}

bool OutputClosed() { return output_closed; }

std::size_t OutputWidth() { return WidthOf(STDOUT_FILENO); }

void PrintText(std::string_view text) {
  const std::string wrapped = internal::WrapText(text, OutputWidth());
  Print(SupportsColour(STDOUT_FILENO) ? Coloured(wrapped) : wrapped);
}

std::string DurationText(double s) {
  if (s < 120.0) return internal::RoundedText(s, 2) + " s";
  return s < 7200.0 ? internal::RoundedText(s / 60.0, 2) + " min"
                    : internal::RoundedText(s / 3600.0, 2) + " h";
}

void WritePageFile(const std::filesystem::path& file, std::string_view page) {
  internal::OutputFile output(file);
  output.Write(page);
  output.Close();
}

std::string ReportLine(std::filesystem::path path) {
  if (std::filesystem::is_directory(path)) path /= "report.html";
  return "\nreport   " + path.string() + '\n';
}

void PrintErrors(std::string_view text) {
  const bool colour = SupportsColour(STDERR_FILENO);
  std::string lines, last_excerpt;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (line.empty()) continue;
    const bool is_continued = line[0] == ' ';
    lines +=
        is_continued ? Fitted(Sanitise(line)) + '\n' : MessageLine("error", line, kRed, colour);
    const std::string excerpt = is_continued ? "" : Excerpt(line);
    if (excerpt != last_excerpt) lines += Sanitise(excerpt);
    last_excerpt = excerpt;
  }
  WriteError(lines);
}

void PrintNote(std::string_view text) { WriteError(Fitted(Sanitise(text)) + '\n'); }

void ShowLog(LogLevel minimum_level) {
  static const LogSubscription terminal(minimum_level, [coloured = SupportsColour(STDERR_FILENO)](
                                                           LogLevel level, std::string_view text) {
    WriteMessage(level, text, coloured);
  });
}

Progress::Progress(const char* unit, bool quiet)
    : unit_(unit), enabled_(!quiet && IsTerminal(STDERR_FILENO)) {}

void Progress::Show(std::int64_t done, std::int64_t total, const char* unit) {
  if (!enabled_) return;
  shown_ = Clock::now();
  if (shown_ < next_ && done != total) return;
  const double elapsed_s = std::chrono::duration<double>(shown_ - begin_).count();
  line_ = std::to_string(done);
  if (total > 0) line_ += " of " + std::to_string(total);
  line_.append(" ").append(unit);
  if (total > 0) line_ += ", " + std::to_string(100 * done / total) + " %";
  constexpr double kMinRated_s = 0.5;
  if (elapsed_s > kMinRated_s && done > 0) {
    const double rate = static_cast<double>(done) / elapsed_s;
    line_ += ", " + internal::FixedText(rate, rate < 10.0 ? 1 : 0) + "/s";
    if (total > done)
      line_ += ", " + DurationText(static_cast<double>(total - done) / rate) + " left";
  }
  Write(line_);
}

void Progress::Tick() {
  const auto now = Clock::now();
  if (!enabled_ || now < next_) return;
  const double step_s = std::chrono::duration<double>(now - shown_).count();
  constexpr double kLong_s = 0.5;
  if (step_s > kLong_s) Write(line_ + "; in this step for " + DurationText(step_s));
}

void Progress::Write(std::string line) {
  next_ = Clock::now() + std::chrono::milliseconds(100);
  // If the previous line was longer, blanks overwrite its end. Escape sequences are not needed.
  line.resize(std::min(line.size(), WidthOf(STDERR_FILENO) - 1));
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

void StopOnSignals(const char* answer) {
  stop_answer = IsTerminal(STDERR_FILENO) ? answer : nullptr;
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
