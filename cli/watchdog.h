// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "alidade/record/recorder.h"

namespace alidade::cli {

/// Watches a run from a thread of its own. Where an estimator works on one frame, or on its start,
/// for longer than a limit, or for more than 5 s after it was asked to stop, it hangs in a model:
/// the watchdog says which one was called last, keeps what was recorded, and ends the process, with
/// kPlugin or kStopped. A source that waits for data is not watched, nor what reads the output, nor
/// the smoothing after the last frame; time in which the process stands still does not count. Where
/// there can be no thread there is no watch.
class Watchdog {
 public:
  /// Of a run on this thread. No limit: only requests to stop count.
  Watchdog(std::optional<double> limit_s, const Recorder& recorder);
  ~Watchdog();
  Watchdog(const Watchdog&) = delete;
  Watchdog& operator=(const Watchdog&) = delete;

  /// RunOptions::busy.
  void Work(bool busy);

 private:
  void Watch();
  [[noreturn]] void End(const std::string& why, ExitCode code) const;

  const std::optional<double> limit_s_;
  const Recorder& recorder_;
  const std::atomic<const void*>& last_call_;  ///< of the thread of the run
  std::mutex mutex_;
  std::condition_variable changed_;
  bool ends_ = false, working_ = false;
  std::int64_t works_ = 0;                      ///< how often one began
  double worked_s_ = 0.0, after_stop_s_ = 0.0;  ///< of the one at hand
  std::thread thread_;
};

}  // namespace alidade::cli
