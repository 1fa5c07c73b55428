// SPDX-License-Identifier: Apache-2.0
#include "console.h"

#include <fcntl.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <climits>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <iterator>
#include <mutex>
#include <new>
#include <system_error>

#include "alidade/base/error.h"
#include "alidade/base/signal_stack.h"
#include "alidade/base/utf8.h"
#include "alidade/host/last_call.h"

namespace alidade::cli {
namespace {

std::atomic<bool> stop_requested{false}, finishing{false};
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler sets it");

extern "C" void HandleStop(int signal_number) {
  if (!stop_requested.exchange(true) || finishing) return;
  ::signal(signal_number, SIG_DFL);
  ::raise(signal_number);
}

constexpr char kCrashed[] =
    "error: crashed, most likely inside a model, a source or an estimator of a plugin";
constexpr char kExited[] = "error: a model, a source or an estimator of a plugin ended the process";
constexpr char kStopped[] =
    "error: a model, a source or an estimator of a plugin wanted to stop the process (SIGSTOP)";
constexpr char kRemedy[] = "; `alidade check PLUGIN` finds what is wrong with a model\n";

/// The process whose end is looked at; 0: none yet. A child of it ends as it likes.
std::atomic<pid_t> watched{0};

/// Where what was recorded is; "": nowhere.
char recorded_in[PATH_MAX] = "";

/// Only calls that a signal handler may make.
void Say(const char* text) {
  if (::write(STDERR_FILENO, text, std::strlen(text)) < 0) return;
}

/// What happened, which model this thread called last, and where what was recorded is.
void SayWithCall(const char* what) {
  char call[1024];
  DescribeCall(detail::last_call, call, sizeof call);
  Say(what);
  if (*call != '\0') Say("; the last call of a model: ");
  Say(call);
  if (*recorded_in != '\0' && ::access(recorded_in, F_OK) == 0) {
    Say("; what was recorded is in ");
    Say(recorded_in);
  }
  Say(kRemedy);
}

[[noreturn]] void ExitNow(int code) {
  for (;;) ::syscall(SYS_exit_group, code);
}

extern "C" void HandleCrash(int signal_number) {
  SayWithCall(kCrashed);
  ::signal(signal_number, SIG_DFL);
  ::raise(signal_number);
}

extern "C" void HandleSelfStop(int) {
  SayWithCall(kStopped);
  ExitNow(static_cast<int>(ExitCode::kPlugin));
}

#ifdef __x86_64__
constexpr unsigned kArchitecture = AUDIT_ARCH_X86_64;
#else
constexpr unsigned kArchitecture = AUDIT_ARCH_AARCH64;
#endif

/// No watchdog runs in a process that has stopped: its own call with SIGSTOP becomes SIGSYS. What
/// others send, and ^Z, stop it as ever. Nothing happens where the kernel does not have this.
void TrapSelfStop() {
  constexpr auto kWord = BPF_LD | BPF_W | BPF_ABS;
  constexpr auto kIf = BPF_JMP | BPF_JEQ | BPF_K;
  sock_filter code[] = {
      BPF_STMT(kWord, offsetof(seccomp_data, arch)),
      BPF_JUMP(kIf, kArchitecture, 0, 8),
      BPF_STMT(kWord, offsetof(seccomp_data, nr)),
      BPF_JUMP(kIf, SYS_tgkill, 3, 0),
      BPF_JUMP(kIf, SYS_kill, 0, 5),
      BPF_STMT(kWord, offsetof(seccomp_data, args[1])),  // of kill
      BPF_STMT(BPF_JMP | BPF_JA, 1),
      BPF_STMT(kWord, offsetof(seccomp_data, args[2])),  // of tgkill
      BPF_JUMP(kIf, SIGSTOP, 0, 1),
      BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_TRAP),
      BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW),
  };
  const sock_fprog filter{static_cast<unsigned short>(std::size(code)), code};
  if (::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) return;
  ::syscall(SYS_seccomp, SECCOMP_SET_MODE_FILTER, SECCOMP_FILTER_FLAG_SPEC_ALLOW, &filter);
}

/// The process is about to end with that code, which nobody asked for while it is watched.
int CodeOfEnd(int code) {
  if (finishing || watched.load() != ::getpid()) return code;
  finishing = true;
  SayWithCall(kExited);
  return static_cast<int>(ExitCode::kPlugin);
}

extern "C" void HandleExit() {
  if (const int code = CodeOfEnd(0); code != 0) ExitNow(code);
}

std::terminate_handler end_by_default = nullptr;

/// An exception left what must not throw, as some functions of CLI11 and std::filesystem: where
/// memory ran out, that is an error like any other.
[[noreturn]] void HandleTerminate() {
  try {
    if (std::current_exception() != nullptr) throw;
  } catch (const std::bad_alloc&) {
    Say("error: out of memory\n");
    ExitNow(static_cast<int>(ExitCode::kInternal));
  } catch (...) {
    end_by_default();
  }
  SayWithCall(
      "error: ended without an exception, as a library does when it is out of memory, or a plugin "
      "that leaves a thread behind");
  ExitNow(static_cast<int>(ExitCode::kInternal));
}

/// Writes all of it; false with errno where that fails.
bool WriteAll(int fd, std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = ::write(fd, text.data(), text.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return false;
    text.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

/// `text` as a terminal may have it: it obeys none of it but the line ends.
std::string Harmless(std::string_view text) { return internal::ShownUtf8(text, "\n\t"); }

/// What cannot be said on standard error cannot be said.
void WriteError(std::string_view text) { static_cast<void>(WriteAll(STDERR_FILENO, text)); }

bool IsSet(const char* variable) {
  const char* value = std::getenv(variable);
  return value != nullptr && *value != '\0';
}

/// A terminal that moves its cursor.
bool OnTerminal() {
  const char* terminal = std::getenv("TERM");
  const bool dumb = terminal == nullptr || std::strcmp(terminal, "dumb") == 0;
  return !dumb && ::isatty(STDERR_FILENO) == 1;
}

bool TakesColour() { return OnTerminal() && !IsSet("NO_COLOR"); }

/// `warning: `, in that colour of a terminal.
std::string Marked(const char* word, const char* colour, bool coloured) {
  const std::string mark = std::string(word) + ':';
  return (coloured ? "\033[1;" + std::string(colour) + 'm' + mark + "\033[0m" : mark) + ' ';
}

/// What stands on the line of progress: messages of any thread go above it.
std::mutex progress_mutex;
std::size_t progress_width = 0;

/// Takes the line of progress off the terminal. The mutex is locked.
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
  WriteError(Marked(ToString(level), colour, coloured) + Harmless(text) + '\n');
}

}  // namespace

void PrepareConsole() {
  end_by_default = std::set_terminate(HandleTerminate);
  ::signal(SIGPIPE, SIG_IGN);
  ::signal(SIGXFSZ, SIG_IGN);
  for (const int fd : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fcntl(fd, F_GETFD) != -1 || errno != EBADF) continue;
    // The lowest free number is this one; opened the wrong way round, so that its use fails.
    static_cast<void>(::open("/dev/null", fd == STDIN_FILENO ? O_WRONLY : O_RDONLY));
  }
}

void Print(std::string_view text) {
  if (WriteAll(STDOUT_FILENO, text)) return;
  const std::string reason = std::generic_category().message(errno);
  throw Error(ExitCode::kIo, "<stdout>: cannot write: " + reason);
}

void PrintErrors(std::string_view text) {
  const bool colour = TakesColour();
  std::string lines;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (line.empty()) continue;
    if (line[0] != ' ') lines += Marked("error", "31", colour);
    lines.append(Harmless(line)).append("\n");
  }
  WriteError(lines);
}

void PrintNote(std::string_view text) { WriteError(Harmless(text) + '\n'); }

void ShowLog(LogLevel least) {
  static const LogSubscription terminal(
      least, [coloured = TakesColour()](LogLevel level, std::string_view text) {
        WriteMessage(level, text, coloured);
      });
}

Progress::Progress(const char* unit, bool quiet) : unit_(unit), enabled_(!quiet && OnTerminal()) {}

void Progress::Show(std::int64_t done, std::int64_t total) {
  if (!enabled_) return;
  const auto now = std::chrono::steady_clock::now();
  if (now < next_) return;
  next_ = now + std::chrono::milliseconds(100);
  std::string line = std::to_string(done);
  if (total > 0) line += " of " + std::to_string(total);
  line.append(" ").append(unit_);
  if (total > 0) line += ", " + std::to_string(100 * done / total) + " %";
  // Blanks, not an escape sequence, cover what a longer line left.
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

void ReportCrashes() {
  if (watched != 0) return;
  static const internal::SignalStack stack;  // outlives HandleExit
  struct sigaction action {
  }, before{};
  action.sa_handler = HandleCrash;
  action.sa_flags = SA_ONSTACK;
  sigemptyset(&action.sa_mask);
  for (const int crash : {SIGSEGV, SIGBUS, SIGILL, SIGFPE, SIGABRT}) {
    const bool free = ::sigaction(crash, nullptr, &before) == 0 && before.sa_handler == SIG_DFL;
    if (free) ::sigaction(crash, &action, nullptr);  // else a sanitizer, say, has its own
  }
  action.sa_handler = HandleSelfStop;
  ::sigaction(SIGSYS, &action, nullptr);
  TrapSelfStop();
  watched = ::getpid();
  std::atexit(HandleExit);
}

void TellIfCrashed(const std::string& folder) {
  recorded_in[folder.copy(recorded_in, sizeof recorded_in - 1)] = '\0';
}

void StopOnSignals() {
  struct sigaction action {};
  action.sa_handler = HandleStop;
  sigemptyset(&action.sa_mask);
  action.sa_flags = 0;  // a wait for data ends
  ::sigaction(SIGINT, &action, nullptr);
  ::sigaction(SIGTERM, &action, nullptr);
  ::sigaction(SIGHUP, &action, nullptr);  // the terminal is gone
}

bool StopRequested() { return stop_requested; }

void FinishOnSignals() { finishing = true; }

}  // namespace alidade::cli

// In place of the C library's, for plugins too: of what ends the process at once, without the
// handlers of atexit.
extern "C" {
[[gnu::visibility("default")]] void _exit(int code) {
  alidade::cli::ExitNow(alidade::cli::CodeOfEnd(code));
}
[[gnu::visibility("default")]] void _Exit(int code) { _exit(code); }
}
