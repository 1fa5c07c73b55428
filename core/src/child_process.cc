// SPDX-License-Identifier: Apache-2.0
#include "child_process.h"

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

#include "alidade/error.h"
#include "number_text.h"

namespace alidade::internal {
namespace {

using Clock = std::chrono::steady_clock;

Journal* g_journal = nullptr;  // of this child, for OnTerminate

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

/// A crash of the child must neither reach the handlers of the program, nor print, nor dump core.
void PrepareChild(const ChildLimits& limits, pid_t parent) {
  setpgid(0, 0);
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(1);
  for (const int signal : {SIGSEGV, SIGBUS, SIGILL, SIGFPE, SIGABRT, SIGALRM, SIGTERM, SIGINT}) {
    std::signal(signal, SIG_DFL);
  }
  Limit(RLIMIT_CORE, 0);
  Limit(RLIMIT_CPU, static_cast<rlim_t>(std::ceil(limits.timeout_s)) + 1);
  if (limits.memory_mb > 0) {
    Limit(RLIMIT_AS, SizeNow() + (static_cast<rlim_t>(limits.memory_mb) << 20));
  }
  const int null = open("/dev/null", O_RDWR | O_CLOEXEC);
  if (null >= 0) {
    dup2(null, STDOUT_FILENO);
    dup2(null, STDERR_FILENO);
  }
  std::set_terminate(OnTerminate);
}

/// Sends the answer and a zero, which no answer has: one that was cut off is none.
[[noreturn]] void RunChild(int pipe_end, const std::function<std::string()>& work) noexcept {
  const std::string answer = work();
  std::size_t sent = 0;
  while (sent < answer.size() + 1) {
    const ssize_t count = write(pipe_end, answer.c_str() + sent, answer.size() + 1 - sent);
    if (count < 0 && errno != EINTR) _exit(1);
    if (count > 0) sent += static_cast<std::size_t>(count);
  }
  _exit(0);
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

}  // namespace

void Journal::Enter(const char* call, const std::string& state) {
  std::snprintf(call_, sizeof call_, "%s", call);
  std::snprintf(state_, sizeof state_, "%s", state.c_str());
}

void Journal::Thrown(const char* what) { std::snprintf(thrown_, sizeof thrown_, "%s", what); }

SharedJournal::SharedJournal() {
  void* const memory =
      mmap(nullptr, sizeof(Journal), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) throw Error(ExitCode::kInternal, "no memory to share with a child");
  journal_ = new (memory) Journal();
}

SharedJournal::~SharedJournal() { munmap(journal_, sizeof(Journal)); }

ChildEnd RunInChild(const ChildLimits& limits, Journal& journal,
                    const std::function<std::string()>& work) {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) return {false, std::string("has no pipe: ") + strerror(errno)};
  const auto timeout =
      std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(limits.timeout_s));
  const pid_t parent = getpid();
  const pid_t child = fork();
  if (child == 0) {
    close(ends[0]);
    g_journal = &journal;
    PrepareChild(limits, parent);
    RunChild(ends[1], work);
  }
  const int fork_error = errno;
  close(ends[1]);
  if (child < 0) {
    close(ends[0]);
    return {false, std::string("has no process: ") + strerror(fork_error)};
  }
  setpgid(child, child);  // by both, so that it holds whoever comes first
  std::string answer;
  const bool in_time = ReadAnswer(ends[0], Clock::now() + timeout, answer);
  close(ends[0]);
  const bool answered = !answer.empty() && answer.back() == '\0';
  if (!in_time) kill(-child, SIGKILL);
  siginfo_t ended;
  while (waitid(P_PID, static_cast<id_t>(child), &ended, WEXITED | WNOWAIT) < 0 && errno == EINTR) {
  }
  kill(-child, SIGKILL);  // whatever it started
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (answered) return {true, answer.substr(0, answer.size() - 1)};
  if (!in_time) return {false, "did not return within " + NumberText(limits.timeout_s) + " s"};
  return {false, EndText(status)};
}

}  // namespace alidade::internal
