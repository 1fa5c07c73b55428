// SPDX-License-Identifier: Apache-2.0
#include "watchdog.h"

#include <unistd.h>

#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <chrono>
#include <iterator>
#include <memory>
#include <system_error>

#include "alidade/base/number_text.h"
#include "console.h"

namespace alidade::cli {

void AddFrameTimeout(CLI::App& command, std::optional<double>& limit_s) {
  const auto read = [&limit_s](const std::string& text) {
    limit_s.reset();
    if (text != "none") limit_s = std::stod(text);
  };
  command
      .add_option_function<std::string>(
          "--frame-timeout", read,
          "seconds that the estimators may take for one frame, or a plugin to create or destroy a "
          "model, before the run ends, or none; a model that hangs is named")
      ->check([](const std::string& text) {
        return text == "none" ? std::string() : IsNumber(0.001, 1e9)(text);
      })
      ->default_str("60");
}

Watchdog::Watchdog(std::optional<double> limit_s) : limit_s_(limit_s) {
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

RunResult Watchdog::Run(Experiment& experiment, RunOptions options, const Recorder* recorder) {
  std::unique_lock lock(mutex_);
  runs_.emplace_back(detail::last_call, recorder);
  const auto frames = std::prev(runs_.end());
  lock.unlock();
  const auto remove = [&](const Frames*) {
    const std::lock_guard again(mutex_);
    runs_.erase(frames);
  };
  const std::unique_ptr<const Frames, decltype(remove)> removed(&*frames, remove);
  options.busy = [&frames = *frames](bool busy) {
    const std::int64_t even = (frames.turns.load(std::memory_order_relaxed) | 1) + 1;
    frames.turns.store(even + (busy ? 1 : 0), std::memory_order_relaxed);
    if (!busy) frames.started.store(true, std::memory_order_relaxed);
  };
  options.progress = [&frames = *frames, progress = options.progress](std::int64_t done,
                                                                      std::int64_t all) {
    frames.done.store(done, std::memory_order_relaxed);
    if (progress) progress(done, all);
  };
  return alidade::Run(experiment, options);
}

void Watchdog::Watch() {
  using Clock = std::chrono::steady_clock;
  constexpr auto kLook = std::chrono::milliseconds(200);
  constexpr double kMostOfALook = 0.4;
  Clock::time_point before = Clock::now();
  std::unique_lock lock(mutex_);
  while (!changed_.wait_for(lock, kLook, [&] { return ends_; })) {
    const Clock::time_point now = Clock::now();
    // More has passed where the whole process was stopped.
    const double passed_s =
        std::min(std::chrono::duration<double>(now - before).count(), kMostOfALook);
    before = now;
    const LastingCall call = OldestLastingCall();
    if (call.number != call_) of_call_ = {};
    call_ = call.number;
    constexpr const char* kNoReturn = "a plugin does not return";
    if (call_ != 0) Check(of_call_, passed_s, call.slot, kNoReturn, kNoReturn);
    for (Frames& frames : runs_) {
      const std::int64_t turn = frames.turns;
      if (turn != frames.seen) frames.spell = {};
      frames.seen = turn;
      if (turn % 2 == 0) continue;
      const std::string of = frames.started
                                 ? "one frame, after " + std::to_string(frames.done) + " others"
                                 : "its start";
      Check(frames.spell, passed_s, frames.last_call, "an estimator works on " + of,
            "an estimator does not finish " + of);
    }
  }
}

void Watchdog::Check(Spell& spell, double passed_s, const void* call, const std::string& works,
                     const std::string& is_stuck) const {
  constexpr double kPatience = 5.0;
  spell.worked_s += passed_s;
  if (StopRequested()) spell.after_stop_s += passed_s;
  if (spell.after_stop_s > kPatience)
    End("asked to stop, but " + is_stuck, call, ExitCode::kStopped);
  if (limit_s_ && spell.worked_s > *limit_s_) {
    End(works + ", for more than " + internal::RoundedText(*limit_s_, 6) + " s", call,
        ExitCode::kPlugin);
  }
}

void Watchdog::End(const std::string& why, const void* call, ExitCode code) const {
  char words[1024];
  DescribeCall(call, words, sizeof words);
  std::string text = why;
  if (*words != '\0') text += std::string("; the last call of a model: ") + words;
  for (const Frames& frames : runs_) {
    if (frames.recorder == nullptr) continue;
    try {
      const std::filesystem::path kept = frames.recorder->failed();
      if (!kept.empty() && frames.recorder->Abandon()) {
        text += "; what was recorded is in " + kept.string();
      }
    } catch (const std::exception&) {  // it stays where it is; the next run to that place finds it
    }
  }
  PrintErrors(text + '\n');
  FinishOnSignals();
  ::_exit(static_cast<int>(code));
}

}  // namespace alidade::cli
