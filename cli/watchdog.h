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

#include "alidade/host/last_call.h"
#include "alidade/record/recorder.h"

namespace alidade::cli {

/// Watches the process from a thread of its own. Where a plugin creates or destroys a model, or an
/// estimator of a run works on one frame, or on its start, for longer than a limit, or for more
/// than 5 s after it was asked to stop, it hangs in a model: the watchdog says which one was called
/// last, keeps what was recorded, and ends the process, with kPlugin or kStopped. A source that
/// waits for data is not watched, nor what reads the output, nor the smoothing after the last
/// frame; time in which the process stands still does not count. Where there can be no thread there
/// is no watch. Made once plugins are loaded, which
/// forks.
class Watchdog {
 public:
  static constexpr double kUsualLimit_s = 60.0;

  /// Its estimators work on this thread. No limit: only requests to stop count.
  explicit Watchdog(std::optional<double> limit_s = kUsualLimit_s);
  ~Watchdog();
  Watchdog(const Watchdog&) = delete;
  Watchdog& operator=(const Watchdog&) = delete;

  /// What this records is kept. It outlives the watchdog.
  void Keep(const Recorder& recorder);
  /// RunOptions::busy.
  void Work(bool busy);

 private:
  void Watch();
  std::string Frame() const;
  [[noreturn]] void End(const std::string& why, const void* call, ExitCode code) const;

  const std::optional<double> limit_s_;
  const std::atomic<const void*>& last_call_;  ///< of the thread of the run
  std::mutex mutex_;
  std::condition_variable changed_;
  const Recorder* recorder_ = nullptr;
  bool ends_ = false, working_ = false;
  std::int64_t works_ = 0;                      ///< how often one began
  LastingCall lasting_;                         ///< beside works
  double worked_s_ = 0.0, after_stop_s_ = 0.0;  ///< of the one at hand
  std::thread thread_;
};

}  // namespace alidade::cli
