// SPDX-License-Identifier: Apache-2.0
#include "watchdog.h"

#include <unistd.h>

#include <algorithm>
#include <system_error>

#include "alidade/base/number_text.h"
#include "console.h"

namespace alidade::cli {

Watchdog::Watchdog(std::optional<double> limit_s)
    : limit_s_(limit_s), last_call_(detail::last_call) {
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

void Watchdog::Keep(const Recorder& recorder) {
  const std::lock_guard lock(mutex_);
  recorder_ = &recorder;
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
    const LastingCall lasting = working_ ? LastingCall() : OldestLastingCall();
    if (lasting.number != lasting_.number) worked_s_ = after_stop_s_ = 0.0;
    lasting_ = lasting;
    if (!working_ && lasting.number == 0) continue;
    worked_s_ += passed;
    if (StopRequested()) after_stop_s_ += passed;
    const void* const call = working_ ? last_call_.load() : lasting.slot;
    if (after_stop_s_ > kPatience) {
      End("asked to stop, but " +
              (working_ ? "an estimator does not finish " + Frame() : "a plugin does not return"),
          call, ExitCode::kStopped);
    }
    if (limit_s_ && worked_s_ > *limit_s_) {
      End((working_ ? "an estimator works on " + Frame() : "a plugin does not return") +
              ", for more than " + internal::RoundedText(*limit_s_, 6) + " s",
          call, ExitCode::kPlugin);
    }
  }
}

std::string Watchdog::Frame() const {
  return works_ <= 1 ? "its start" : "one frame, after " + std::to_string(works_ - 2) + " others";
}

void Watchdog::End(const std::string& why, const void* call, ExitCode code) const {
  char words[1024];
  DescribeCall(call, words, sizeof words);
  std::string text = why;
  if (*words != '\0') text += std::string("; the last call of a model: ") + words;
  try {
    const std::filesystem::path kept = recorder_ == nullptr ? "" : recorder_->failed();
    if (!kept.empty() && recorder_->Abandon()) text += "; what was recorded is in " + kept.string();
  } catch (const std::exception&) {  // it stays where it is; the next run to that place finds it
  }
  PrintErrors(text + '\n');
  FinishOnSignals();
  ::_exit(static_cast<int>(code));
}

}  // namespace alidade::cli
