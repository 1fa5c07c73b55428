// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <list>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "alidade/record/recorder.h"
#include "command.h"

namespace alidade::cli {

constexpr double kUsualFrameTimeout_s = 60.0;

/// The option --frame-timeout.
void AddFrameTimeout(CLI::App& command, std::optional<double>& limit_s);

/// Watches the process from a thread of its own. Where a plugin creates or destroys a model, or an
/// estimator of a run works on one frame, or on its start, for longer than a limit, or for more
/// than 5 s after it was asked to stop, it hangs in a model: the watchdog says which one was called
/// last, keeps what was recorded, and ends the process, with kPlugin or kStopped. A source that
/// waits for data is not watched, nor what reads the output, nor the smoothing after the last
/// frame; time in which the process stands still does not count. Where there can be no thread there
/// is no watch. Made once plugins are loaded, which forks.
class Watchdog {
 public:
  /// No limit: only requests to stop count.
  explicit Watchdog(std::optional<double> limit_s = kUsualFrameTimeout_s);
  ~Watchdog();
  Watchdog(const Watchdog&) = delete;
  Watchdog& operator=(const Watchdog&) = delete;

  /// alidade::Run, watched; of several threads at once. What `recorder` records is kept.
  RunResult Run(Experiment& experiment, RunOptions options, const Recorder* recorder = nullptr);

 private:
  /// What may last for too long, and how long it has.
  struct Spell {
    double worked_s = 0.0, after_stop_s = 0.0;
  };
  /// The frames of a run. Its thread writes without a lock: a frame may take a microsecond, and a
  /// lock that the threads of a sweep share would be a tenth of that and more.
  struct Frames {
    Frames(const std::atomic<const void*>& call, const Recorder* of)
        : last_call(call), recorder(of) {}

    const std::atomic<const void*>& last_call;  ///< of its thread
    const Recorder* recorder;                   ///< null: none
    std::atomic<std::int64_t> turns{0};  ///< rises where work begins, to an odd number, or ends
    std::atomic<bool> started{false};    ///< the work before the first frame is done
    std::atomic<std::int64_t> done{0};   ///< frames
    std::int64_t seen = 0;               ///< the turns at the last look
    Spell spell = {};                    ///< of that turn
  };

  void Watch();
  void Check(Spell& spell, double passed_s, const void* call, const std::string& works,
             const std::string& is_stuck) const;
  [[noreturn]] void End(const std::string& why, const void* call, ExitCode code) const;

  const std::optional<double> limit_s_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool ends_ = false;
  std::list<Frames> runs_;
  std::uint64_t call_ = 0;  ///< LastingCall::number
  Spell of_call_;
  std::thread thread_;
};

}  // namespace alidade::cli
