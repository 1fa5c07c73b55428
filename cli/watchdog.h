// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "alidade/record/recorder.h"
#include "alidade/run/run_observer.h"

namespace alidade::cli {

/// Watches a run from a thread of its own. Where its estimators work on one frame for longer than a
/// limit, or for more than 5 s after they were asked to stop, they hang in a model: it says which
/// one was called last, keeps what was recorded, and ends the process, with kPlugin or kStopped. So
/// does it before the first frame. A source that waits for data is not watched, nor is the
/// smoothing after the last frame. Where there can be no thread there is no watch.
class Watchdog : public RunObserver {
 public:
  /// Of a run on this thread. No limit: only requests to stop count.
  Watchdog(std::optional<double> limit_s, Recorder& recorder);
  ~Watchdog() override;

  /// The estimators are ready.
  void Begin(const Experiment& experiment) override;
  /// They have a frame, until FrameDone().
  void OnFrame(const SourceFrame& frame) override;
  void FrameDone();

 private:
  using Clock = std::chrono::steady_clock;

  void Watch();
  [[noreturn]] void End(const std::string& why, ExitCode code);

  const std::optional<double> limit_s_;
  Recorder& recorder_;
  const void* const* const last_call_;  ///< of the thread of the run
  std::mutex mutex_;
  std::condition_variable changed_;
  bool ends_ = false, working_ = true;
  std::int64_t frames_ = -1;  ///< done; -1: it begins
  Timestamp timestamp_ = 0;   ///< of the frame at hand
  Clock::time_point since_ = Clock::now();
  std::thread thread_;
};

}  // namespace alidade::cli
