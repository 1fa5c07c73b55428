// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <optional>

#include "alidade/compare/compare.h"

namespace alidade::internal {

/// Wall-clock budget of a series of runs. Several threads may use it at the same time.
class RunBudget {
 public:
  /// Starts the clock. If `limit_s` is nullopt, the budget is unlimited.
  explicit RunBudget(std::optional<double> limit_s) : limit_s_(limit_s) {}

  double elapsed_s() const;
  /// Records the duration of a finished run.
  void RecordRun(double run_s);
  /// Returns true if the next run would exceed the limit. The next run is assumed to take as long
  /// as the longest recorded run. Returns false if no run is recorded yet.
  bool is_spent() const;

 private:
  std::optional<double> limit_s_;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  std::atomic<double> longest_s_{0.0};
};

/// CPU time of each estimator over all frames, predicted from the first frames.
struct PredictedCpuTime {
  std::vector<double> cpu_s;  ///< CPU time of each estimator
  std::int64_t frames = 0;    ///< number of frames whose CPU time was measured
  std::int64_t total_frames = 0;
};

/// Predicts the CPU time from the first ten frames. The experiment cannot be used afterwards. N is
/// the number of frames. The cost of a single solve of all data is assumed to be proportional to N.
/// The total cost of a solve at every frame is assumed to be proportional to N^2. Returns nullopt
/// if the source does not report N, or if the run failed.
std::optional<PredictedCpuTime> PredictCpuTime(Experiment& experiment);

}  // namespace alidade::internal
