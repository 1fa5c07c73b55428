// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <optional>

#include "alidade/compare/compare.h"

namespace alidade::internal {

/// Time of the wall clock that several runs may take together; of several threads at once.
class RunBudget {
 public:
  /// It begins now; none: there is no limit.
  explicit RunBudget(std::optional<double> limit_s) : limit_s_(limit_s) {}

  double elapsed_s() const;
  /// Takes how long a run was.
  void Note(double run_s);
  /// Whether one more run, as long as the longest one, would end too late; false before the first
  /// run is done.
  bool spent() const;

 private:
  std::optional<double> limit_s_;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  std::atomic<double> longest_s_{0.0};
};

/// CPU time of estimators over all frames, foretold from the first ones, s.
struct ForetoldTime {
  std::vector<double> of;  ///< by estimator
  std::int64_t frames = 0, all_frames = 0;
};

/// Runs the experiment, which is then of no more use, over its first ten frames. A solve of all
/// data is taken to grow with their number N, one at every frame with N^2. None where the source
/// does not know N, or the run failed.
std::optional<ForetoldTime> ForetellTime(Experiment& experiment);

}  // namespace alidade::internal
