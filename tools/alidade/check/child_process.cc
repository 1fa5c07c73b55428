// SPDX-License-Identifier: Apache-2.0
#include "alidade/check/child_process.h"

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
#include <csignal>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <new>

#include "alidade/base/error.h"
#include "alidade/base/number_text.h"

namespace alidade::internal {
namespace {

using Clock = std::chrono::steady_clock;

/// Pipe. The destructor closes both ends.
class Pipe {
 public:
  explicit Pipe(int flags) {
    if (pipe2(ends_, O_CLOEXEC | flags) == 0) return;
    throw Error(ExitCode::kInternal,
                std::string("cannot create a pipe to a child process: ") + strerror(errno));
  }
  ~Pipe() {
    close(ends_[0]);
    CloseWriteEnd();
  }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;

  int read_end() const { return ends_[0]; }
  int write_end() const { return ends_[1]; }
  void CloseWriteEnd() {
    if (ends_[1] >= 0) close(ends_[1]);
    ends_[1] = -1;
  }

 private:
  int ends_[2];
};

void Limit(int resource, rlim_t value) {
  const rlimit limit{value, value};
  setrlimit(resource, &limit);
}

/// Returns the present size of the address space.
rlim_t AddressSpace() {
  rlim_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  return pages * static_cast<rlim_t>(sysconf(_SC_PAGESIZE));
}

/// Runs `work` in the child and sends the answer. A final zero byte marks the answer as complete.
[[noreturn]] void RunChild(const ChildLimits& limits, pid_t parent, const Pipe& answer,
                           const Pipe& output, const std::function<std::string()>& work) noexcept {
  setpgid(0, 0);
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(1);
  for (int signal = 1; signal < NSIG; ++signal) std::signal(signal, SIG_DFL);
  Limit(RLIMIT_CORE, 0);
  if (limits.memory_mb > 0) {
    Limit(RLIMIT_AS, AddressSpace() + (static_cast<rlim_t>(limits.memory_mb) << 20));
  }
  dup2(output.write_end(), STDOUT_FILENO);
  dup2(output.write_end(), STDERR_FILENO);
  const std::string text = work();
  std::fflush(nullptr);
  const std::size_t size = text.size() + 1;
  for (std::size_t sent = 0; sent < size;) {
    const ssize_t count = write(answer.write_end(), text.c_str() + sent, size - sent);
    if (count < 0 && errno != EINTR) _exit(1);
    if (count > 0) sent += static_cast<std::size_t>(count);
  }
  _exit(0);
}

/// Reads up to a zero byte or the end of the pipe. Returns false if the deadline has passed.
bool ReadAnswer(int pipe_end, Clock::time_point deadline, std::string& text) {
  char buffer[4096];
  while (text.empty() || text.back() != '\0') {
    const auto remaining_ms =
        std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now()).count();
    if (remaining_ms <= 0) return false;
    pollfd end{pipe_end, POLLIN, 0};
    if (poll(&end, 1, static_cast<int>(std::min<long long>(remaining_ms, 1 << 30))) <= 0) continue;
    const ssize_t count = read(pipe_end, buffer, sizeof buffer);
    if (count == 0 || (count < 0 && errno != EINTR)) return true;
    if (count > 0) text.append(buffer, static_cast<std::size_t>(count));
  }
  return true;
}

std::string EndText(int status) {
  if (WIFSIGNALED(status)) {
    const int signal = WTERMSIG(status);
    return "crashed (signal " + std::to_string(signal) + ", " + strsignal(signal) + ')';
  }
  return "ended the process with exit code " + std::to_string(WEXITSTATUS(status));
}

/// Returns the first line from the pipe. A long line is truncated.
std::string FirstLine(int pipe_end) {
  char line[80] = "";
  if (read(pipe_end, line, sizeof line - 1) < 0) return {};
  line[strcspn(line, "\n")] = '\0';
  return line;
}

}  // namespace

CallRecord::CallRecord() {
  void* const memory =
      mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED)
    throw Error(ExitCode::kInternal, "cannot allocate memory that is shared with a child process");
  shared_ = new (memory) Shared();
}

CallRecord::~CallRecord() { munmap(shared_, sizeof(Shared)); }

void CallRecord::Enter(const char* call, const std::string& state) {
  std::snprintf(shared_->call, sizeof shared_->call, "%s", call);
  std::snprintf(shared_->state, sizeof shared_->state, "%s", state.c_str());
}

ChildEnd RunInChild(const ChildLimits& limits, const std::function<std::string()>& work) {
  Pipe answer(0), output(O_NONBLOCK);
  // Without this call, the child would print the buffered output of the program again.
  std::fflush(nullptr);
  const pid_t parent = getpid();
  const pid_t child = fork();
  if (child == 0) RunChild(limits, parent, answer, output, work);
  if (child < 0) {
    throw Error(ExitCode::kInternal,
                std::string("cannot create a child process: ") + strerror(errno));
  }
  answer.CloseWriteEnd();
  std::string text;
  ChildEnd end;
  const auto timeout =
      std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(limits.timeout_s));
  end.timed_out = !ReadAnswer(answer.read_end(), Clock::now() + timeout, text);
  if (end.timed_out) kill(child, SIGKILL);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  kill(-child, SIGKILL);  // kills the processes that the child has started
  end.answered = !text.empty() && text.back() == '\0';
  if (end.answered) {
    end.text = text.substr(0, text.size() - 1);
  } else {
    end.text = end.timed_out ? "did not return within " + NumberText(limits.timeout_s) + " s"
                             : EndText(status);
  }
  end.printed = FirstLine(output.read_end());
  return end;
}

}  // namespace alidade::internal
