// SPDX-License-Identifier: Apache-2.0
#include "watchdog.h"

#include <unistd.h>

#include <algorithm>
#include <system_error>

#include "alidade/base/number_text.h"
#include "alidade/host/last_call.h"
#include "console.h"

namespace alidade::cli {

Watchdog::Watchdog(std::optional<double> limit_s, const Recorder& recorder)
    : limit_s_(limit_s), recorder_(recorder), last_call_(detail::last_call) {
  try {
    thread_ = std::thread([this] { Watch(); });
  } catch (const std::system_error&) {  // no memory for it, say: the run may do with less
  }
}

Watchdog::~Watchdog() {
  {
    const std::lock_guard lock(mutex_);
    ends_ = true;
  }
  changed_.notify_one();
  if (thread_.joinable()) thread_.join();
}

void Watchdog::Work(bool busy) {
  const std::lock_guard lock(mutex_);
  working_ = busy;
  works_ += busy ? 1 : 0;
  worked_s_ = after_stop_s_ = 0.0;
}

void Watchdog::Watch() {
  using Clock = std::chrono::steady_clock;
  constexpr auto kLook = std::chrono::milliseconds(200);
  constexpr double kPatience = 5.0, kMostOfALook = 0.4;
  Clock::time_point before = Clock::now();
  std::unique_lock lock(mutex_);
  while (!changed_.wait_for(lock, kLook, [&] { return ends_; })) {
    const Clock::time_point now = Clock::now();
    // More has passed where the whole process was stopped.
    const double passed =
        std::min(std::chrono::duration<double>(now - before).count(), kMostOfALook);
    before = now;
    if (!working_) continue;
    worked_s_ += passed;
    if (StopRequested()) after_stop_s_ += passed;
    const std::string frame =
        works_ <= 1 ? "its start" : "one frame, after " + std::to_string(works_ - 2) + " others";
    if (after_stop_s_ > kPatience) {
      End("asked to stop, but an estimator does not finish " + frame, ExitCode::kStopped);
    }
    if (limit_s_ && worked_s_ > *limit_s_) {
      End("an estimator works on " + frame + ", for more than " +
              internal::RoundedText(*limit_s_, 6) + " s",
          ExitCode::kPlugin);
    }
  }
}

void Watchdog::End(const std::string& why, ExitCode code) const {
  char call[1024];
  DescribeCall(last_call_, call, sizeof call);
  std::string text = why;
  if (*call != '\0') text += std::string("; the last call of a model: ") + call;
  try {
    const std::filesystem::path kept = recorder_.failed();
    if (recorder_.Abandon()) text += "; what was recorded is in " + kept.string();
  } catch (const std::exception&) {  // it stays where it is; the next run to that place finds it
  }
  PrintErrors(text + '\n');
  FinishOnSignals();
  ::_exit(static_cast<int>(code));
}

}  // namespace alidade::cli
