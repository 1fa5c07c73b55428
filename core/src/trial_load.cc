// SPDX-License-Identifier: Apache-2.0
#include <dlfcn.h>
#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>

#include "alidade/build_plugin.h"
#include "plugin_file.h"

namespace alidade::internal {
namespace {

constexpr unsigned kTimeLimit_s = 30;

/// A crash of the child must neither reach the handlers of the host, nor print, nor dump core.
void PrepareChild() {
  for (const int signal : {SIGSEGV, SIGBUS, SIGILL, SIGFPE, SIGABRT, SIGALRM, SIGTERM, SIGINT}) {
    std::signal(signal, SIG_DFL);
  }
  const rlimit none{0, 0};
  setrlimit(RLIMIT_CORE, &none);
  const int null = open("/dev/null", O_RDWR | O_CLOEXEC);
  if (null >= 0) {
    dup2(null, STDOUT_FILENO);
    dup2(null, STDERR_FILENO);
  }
  alarm(kTimeLimit_s);
}

std::string DlError() {
  const char* text = dlerror();
  return text == nullptr ? "unknown reason" : text;
}

template <class Table>
std::string WalkTable(void* library, const char* symbol) {
  void* const function = dlsym(library, symbol);
  if (function == nullptr) return "does not export " + std::string(symbol) + ": " + DlError();
  return Defect(reinterpret_cast<const Table* (*)()>(function)());
}

/// In the child.
std::string Try(const std::filesystem::path& file, std::uint32_t tier) {
  void* const library = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr) return "cannot be loaded: " + DlError();
  if (tier == ALIDADE_TIER_BUILD) return WalkTable<BuildTable>(library, kBuildEntrySymbol);
  const std::string defect = WalkTable<AlidadeTable>(library, ALIDADE_ENTRY_SYMBOL);
  // The destructors of its statics run when the host ends; a crash is better found here.
  dlclose(library);
  return defect;
}

/// Sends '+' for success or '-' and the reason.
[[noreturn]] void RunChild(int pipe_end, const std::filesystem::path& file, std::uint32_t tier) {
  PrepareChild();
  std::string verdict;
  try {
    verdict = Try(file, tier);
  } catch (...) {
    verdict = "threw an exception while loading";
  }
  verdict = verdict.empty() ? "+" : '-' + verdict;
  const ssize_t written = write(pipe_end, verdict.data(), verdict.size());
  _exit(written == std::ssize(verdict) ? 0 : 1);
}

std::string ReadAll(int pipe_end) {
  std::string text;
  char buffer[512];
  for (;;) {
    const ssize_t count = read(pipe_end, buffer, sizeof buffer);
    if (count > 0) text.append(buffer, static_cast<std::size_t>(count));
    if (count == 0 || (count < 0 && errno != EINTR)) return text;
  }
}

}  // namespace

std::string TrialLoad(const std::filesystem::path& file, std::uint32_t tier) {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) return std::string("no pipe: ") + std::strerror(errno);
  const pid_t child = fork();
  if (child == 0) {
    close(ends[0]);
    RunChild(ends[1], file, tier);
  }
  const int fork_error = errno;
  close(ends[1]);
  const std::string verdict = child < 0 ? "" : ReadAll(ends[0]);
  close(ends[0]);
  if (child < 0) return std::string("no child process: ") + std::strerror(fork_error);
  int status = 0;
  pid_t waited;
  do {
    waited = waitpid(child, &status, 0);
  } while (waited < 0 && errno == EINTR);
  if (verdict == "+") return {};
  if (!verdict.empty()) return verdict.substr(1);
  if (waited == child && WIFSIGNALED(status)) {
    const int signal = WTERMSIG(status);
    if (signal == SIGALRM) {
      return "did not finish loading within " + std::to_string(kTimeLimit_s) + " s";
    }
    return "crashed while loading (signal " + std::to_string(signal) + ", " + strsignal(signal) +
           ')';
  }
  return "ended the process while loading";
}

}  // namespace alidade::internal
