// SPDX-License-Identifier: Apache-2.0
#include "alidade/host/process_settings.h"

#include <signal.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <cfenv>
#include <cstdint>
#include <cstring>
#include <limits>
#include <system_error>

namespace alidade::internal {
namespace {

std::string HandlerOf(int signal) {
  struct sigaction action {};
  sigset_t blocked;
  if (sigaction(signal, nullptr, &action) != 0) return {};
  sigemptyset(&blocked);
  pthread_sigmask(SIG_BLOCK, nullptr, &blocked);
  std::uintptr_t handler = 0;
  std::memcpy(&handler, &action.sa_handler, sizeof(handler));
  return std::to_string(handler) + ' ' + std::to_string(action.sa_flags) + ' ' +
         std::to_string(sigismember(&blocked, signal));
}

std::string TargetOf(int descriptor) {
  struct stat status {};
  if (fstat(descriptor, &status) != 0) return "closed";
  return std::to_string(status.st_dev) + ':' + std::to_string(status.st_ino);
}

/// umask tells by being set: not for threads that create files at that moment.
unsigned FileMask() {
  const mode_t mask = umask(077);
  umask(mask);
  return mask;
}

}  // namespace

Surroundings::Surroundings()
    : rounding_(std::fegetround()),
      traps_(fegetexcept()),
      flushes_([] {
        const volatile double tiny = std::numeric_limits<double>::min();
        return tiny / 2.0 == 0.0;
      }()),
      locale_(std::setlocale(LC_ALL, nullptr)),
      thread_locale_(uselocale(nullptr)),
      folder_([] {
        std::error_code ignored;  // it may have been removed
        return std::filesystem::current_path(ignored);
      }()),
      umask_(FileMask()),
      alarm_([] {
        bool runs = false;
        for (const auto timer : {ITIMER_REAL, ITIMER_VIRTUAL, ITIMER_PROF}) {
          itimerval value{};
          runs = runs || (getitimer(timer, &value) == 0 &&
                          (value.it_value.tv_sec != 0 || value.it_value.tv_usec != 0));
        }
        return runs;
      }()) {
  for (int signal = 1; signal < NSIG; ++signal) signals_.push_back(HandlerOf(signal));
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    streams_.push_back(TargetOf(stream));
  }
  for (char** entry = environ; entry != nullptr && *entry != nullptr; ++entry) {
    environment_.emplace_back(*entry);
  }
  std::ranges::sort(environment_);
}

std::string Surroundings::ChangeSince(const Surroundings& before) const {
  if (rounding_ != before.rounding_) return "changed the rounding mode";
  if (traps_ != before.traps_) return "changed the floating-point traps";
  if (flushes_ != before.flushes_) return "makes the processor flush small numbers to zero";
  if (locale_ != before.locale_ || thread_locale_ != before.thread_locale_) {
    return "changed the locale from '" + before.locale_ + "' to '" + locale_ + "'";
  }
  if (folder_ != before.folder_) return "changed the current folder to " + folder_.string();
  if (umask_ != before.umask_) return "changed the file mode mask";
  if (alarm_ != before.alarm_) return alarm_ ? "set a timer" : "stopped a timer";
  for (std::size_t i = 0; i < signals_.size(); ++i) {
    if (signals_[i] == before.signals_[i]) continue;
    return "changed what happens at signal " + std::to_string(i + 1) + " (" +
           strsignal(static_cast<int>(i) + 1) + ")";
  }
  constexpr const char* kStreams[] = {"input", "output", "error"};
  for (std::size_t i = 0; i < streams_.size(); ++i) {
    if (streams_[i] == before.streams_[i]) continue;
    return std::string(streams_[i] == "closed" ? "closed" : "redirected") + " standard " +
           kStreams[i];
  }
  if (environment_ != before.environment_) return "changed the environment";
  return {};
}

}  // namespace alidade::internal
