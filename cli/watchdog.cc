// SPDX-License-Identifier: Apache-2.0
#include "watchdog.h"

#include <unistd.h>

#include <algorithm>
#include <system_error>

#include "alidade/base/number_text.h"
#include "alidade/host/last_call.h"
#include "alidade/host/source.h"
#include "console.h"

namespace alidade::cli {

Watchdog::Watchdog(std::optional<double> limit_s, Recorder& recorder)
    : limit_s_(limit_s), recorder_(recorder), last_call_(&detail::last_call) {
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

void Watchdog::Begin(const Experiment& /*experiment*/) {
  const std::lock_guard lock(mutex_);
  working_ = false;
  frames_ = 0;
}

void Watchdog::OnFrame(const SourceFrame& frame) {
  const std::lock_guard lock(mutex_);
  working_ = true;
  timestamp_ = frame.timestamp;
  since_ = Clock::now();
}

void Watchdog::FrameDone() {
  const std::lock_guard lock(mutex_);
  working_ = false;
  ++frames_;
}

void Watchdog::Watch() {
  constexpr auto kLook = std::chrono::milliseconds(200);
  constexpr double kPatience = 5.0;
  Clock::time_point asked = Clock::time_point::max();
  std::unique_lock lock(mutex_);
  while (!changed_.wait_for(lock, kLook, [&] { return ends_; })) {
    const Clock::time_point now = Clock::now();
    if (StopRequested()) asked = std::min(asked, now);
    if (!working_) continue;
    const auto waited = [&](Clock::time_point since) {
      return std::chrono::duration<double>(now - std::max(since, since_)).count();
    };
    const std::string frame = frames_ < 0
                                  ? "their start"
                                  : "the frame at t = " + internal::SecondsText(timestamp_) +
                                        ", after " + std::to_string(frames_) + " others";
    if (asked <= now && waited(asked) > kPatience) {
      End("asked to stop, but the estimators do not finish " + frame, ExitCode::kStopped);
    }
    if (limit_s_ && waited(since_) > *limit_s_) {
      End("the estimators work on " + frame + ", for more than " +
              internal::RoundedText(*limit_s_, 6) + " s",
          ExitCode::kPlugin);
    }
  }
}

void Watchdog::End(const std::string& why, ExitCode code) {
  char call[1024];
  // The thread of the run hangs: it writes this no more.
  DescribeCall(*last_call_, call, sizeof call);
  std::string text = why;
  if (*call != '\0') text += std::string("; the last call of a model: ") + call;
  const std::filesystem::path kept = recorder_.failed();
  if (recorder_.Abandon()) text += "; what was recorded is in " + kept.string();
  PrintErrors(text + '\n');
  FinishOnSignals();
  ::_exit(static_cast<int>(code));
}

}  // namespace alidade::cli
