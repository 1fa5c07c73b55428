// SPDX-License-Identifier: Apache-2.0
#include "alidade/base/child_process.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>
#include <fstream>
#include <new>

#include "alidade/base/error.h"
#include "alidade/base/number_text.h"

namespace alidade::internal {
namespace {

using Clock = std::chrono::steady_clock;

Journal* g_journal = nullptr;  // of this child

/// Says which exception ends the child, then lets it end.
[[noreturn]] void OnTerminate() {
  try {
    if (std::current_exception() != nullptr) throw;
  } catch (const std::exception& e) {
    g_journal->Thrown(e.what());
  } catch (...) {
    g_journal->Thrown("an exception of unknown type");
  }
  std::raise(SIGABRT);
  _exit(1);
}

/// Address space that the process has now.
rlim_t SizeNow() {
  rlim_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  return pages * static_cast<rlim_t>(sysconf(_SC_PAGESIZE));
}

void Limit(int resource, rlim_t value) {
  rlimit limit{value, value};
  rlimit now{};
  if (getrlimit(resource, &now) == 0 && now.rlim_max < value) limit = {now.rlim_max, now.rlim_max};
  setrlimit(resource, &limit);
}

void UseDefaultHandlers() {
  for (const int signal :
       {SIGSEGV, SIGBUS, SIGILL, SIGFPE, SIGABRT, SIGSYS, SIGALRM, SIGTERM, SIGINT}) {
    std::signal(signal, SIG_DFL);
  }
}

/// What a child prints goes into a pipe, as far as it holds; what is more is lost.
struct Printed {
  Printed() {
    if (pipe2(ends, O_CLOEXEC | O_NONBLOCK) != 0) ends[0] = ends[1] = -1;
  }
  ~Printed() {
    if (ends[0] < 0) return;
    close(ends[0]);
    close(ends[1]);
  }
  Printed(const Printed&) = delete;
  Printed& operator=(const Printed&) = delete;
  int ends[2];  ///< to read from, to write to; -1: none
};

/// The first line that was printed, cut where it is too long.
std::string FirstLine(const Printed& printed) {
  char line[80] = "";
  if (read(printed.ends[0], line, sizeof line - 1) < 0) return {};
  line[strcspn(line, "\n")] = '\0';
  return line;
}

/// A crash of the child must neither reach the handlers of the program, nor print, nor dump core.
void PrepareChild(const ChildLimits& limits, pid_t parent, int printed) {
  setpgid(0, 0);
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(1);
  UseDefaultHandlers();
  Limit(RLIMIT_CORE, 0);
  Limit(RLIMIT_CPU, static_cast<rlim_t>(std::ceil(limits.timeout_s)) + 1);
  if (limits.memory_mb > 0) {
    Limit(RLIMIT_AS, SizeNow() + (static_cast<rlim_t>(limits.memory_mb) << 20));
  }
  const int out = printed >= 0 ? printed : open("/dev/null", O_RDWR | O_CLOEXEC);
  if (out >= 0) {
    dup2(out, STDOUT_FILENO);
    dup2(out, STDERR_FILENO);
  }
  std::set_terminate(OnTerminate);
}

/// Sends the answer and a zero, which no answer has: one that was cut off is none.
[[noreturn]] void RunChild(int pipe_end, const std::function<std::string()>& work) noexcept {
  const std::string answer = work();
  std::fflush(nullptr);
  std::size_t sent = 0;
  while (sent < answer.size() + 1) {
    const ssize_t count = write(pipe_end, answer.c_str() + sent, answer.size() + 1 - sent);
    if (count < 0 && errno != EINTR) _exit(1);
    if (count > 0) sent += static_cast<std::size_t>(count);
  }
  _exit(0);
}

/// Kills and reaps all that descends from this process: a subreaper, to which what loses its parent
/// comes back, however it has left group and session.
void EndDescendants() {
  const std::string list = "/proc/self/task/" + std::to_string(getpid()) + "/children";
  for (int found = 1; found > 0;) {
    found = 0;
    std::ifstream children(list);
    for (pid_t child = 0; children >> child;) found += kill(child, SIGKILL) == 0;
    for (int i = 0; i < found; ++i) waitpid(-1, nullptr, 0);
  }
}

/// Ends this process as the one with `status` has ended.
[[noreturn]] void EndLike(int status) {
  if (!WIFSIGNALED(status)) _exit(WEXITSTATUS(status));
  std::signal(WTERMSIG(status), SIG_DFL);
  std::raise(WTERMSIG(status));
  _exit(1);
}

/// Stands between the program and the child that does the work: waits until that has ended, or for
/// SIGTERM, which the program sends, or its end; then leaves no descendant behind.
[[noreturn]] void Supervise(pid_t program, const std::function<void()>& work) noexcept {
  setpgid(0, 0);  // away from what a terminal sends to the program
  prctl(PR_SET_CHILD_SUBREAPER, 1);
  prctl(PR_SET_PDEATHSIG, SIGTERM);
  UseDefaultHandlers();
  Limit(RLIMIT_CORE, 0);
  sigset_t awaited, before;
  sigemptyset(&awaited);
  sigaddset(&awaited, SIGCHLD);
  sigaddset(&awaited, SIGTERM);
  sigprocmask(SIG_BLOCK, &awaited, &before);
  if (getppid() != program) _exit(1);
  const pid_t worker = fork();
  if (worker < 0) _exit(1);
  if (worker == 0) {
    sigprocmask(SIG_SETMASK, &before, nullptr);
    work();
  }
  int status = 0;
  while (waitpid(worker, &status, WNOHANG) == 0) {
    int signal = 0;
    if (sigwait(&awaited, &signal) == 0 && signal == SIGTERM) break;
  }
  EndDescendants();
  sigprocmask(SIG_SETMASK, &before, nullptr);
  EndLike(status);
}

/// What comes until a zero, the end of the pipe or `deadline`. Returns false after the deadline.
bool ReadAnswer(int pipe_end, Clock::time_point deadline, std::string& text) {
  char buffer[4096];
  for (;;) {
    const auto left =
        std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now()).count();
    if (left <= 0) return false;
    pollfd end{pipe_end, POLLIN, 0};
    if (poll(&end, 1, static_cast<int>(std::min<long long>(left, 1 << 30))) <= 0) continue;
    const ssize_t count = read(pipe_end, buffer, sizeof buffer);
    if (count > 0) text.append(buffer, static_cast<std::size_t>(count));
    if (count == 0 || (count < 0 && errno != EINTR)) return true;
    if (!text.empty() && text.back() == '\0') return true;
  }
}

std::string EndText(int status) {
  if (WIFSIGNALED(status)) {
    const int signal = WTERMSIG(status);
    return "crashed (signal " + std::to_string(signal) + ", " + strsignal(signal) + ')';
  }
  return "ended the process with exit code " + std::to_string(WEXITSTATUS(status));
}

/// The answer of a supervised child, which has ended when this returns.
ChildEnd Await(pid_t child, int pipe_end, double timeout_s) {
  const auto timeout =
      std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(timeout_s));
  std::string answer;
  ChildEnd end;
  end.late = !ReadAnswer(pipe_end, Clock::now() + timeout, answer);
  if (end.late) kill(child, SIGTERM);
  kill(child, SIGCONT);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  end.answered = !answer.empty() && answer.back() == '\0';
  if (end.answered) {
    end.text = answer.substr(0, answer.size() - 1);
  } else {
    end.text = end.late ? "did not return within " + NumberText(timeout_s) + " s" : EndText(status);
  }
  return end;
}

}  // namespace

void Journal::Enter(const char* call, const std::string& state) {
  std::snprintf(call_, sizeof call_, "%s", call);
  std::snprintf(state_, sizeof state_, "%s", state.c_str());
}

void Journal::Thrown(const char* what) { std::snprintf(thrown_, sizeof thrown_, "%s", what); }

void EnterInChild(const char* call) {
  if (g_journal != nullptr) g_journal->Enter(call);
}

SharedJournal::SharedJournal() {
  void* const memory =
      mmap(nullptr, sizeof(Journal), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) throw Error(ExitCode::kInternal, "out of memory to share with a child");
  journal_ = new (memory) Journal();
}

SharedJournal::~SharedJournal() { munmap(journal_, sizeof(Journal)); }

ChildEnd RunInChild(const ChildLimits& limits, Journal& journal,
                    const std::function<std::string()>& work) {
  int ends[2];
  ChildEnd end;
  if (pipe2(ends, O_CLOEXEC) != 0) {
    end.text = std::string("has no pipe: ") + strerror(errno);
    return end;
  }
  std::fflush(nullptr);  // else the child prints what the program has not printed yet
  const Printed printed;
  const pid_t program = getpid();
  const pid_t child = fork();
  if (child == 0) {
    close(ends[0]);
    g_journal = &journal;
    Supervise(program, [&] {
      PrepareChild(limits, getppid(), printed.ends[1]);
      RunChild(ends[1], work);
    });
  }
  const int fork_error = errno;
  close(ends[1]);
  if (child < 0) {
    end.text = std::string("has no process: ") + strerror(fork_error);
  } else {
    end = Await(child, ends[0], limits.timeout_s);
    end.printed = FirstLine(printed);
  }
  close(ends[0]);
  return end;
}

}  // namespace alidade::internal
