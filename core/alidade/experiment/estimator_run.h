// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "alidade/estimation/rollback.h"
#include "alidade/experiment/metrics.h"
#include "alidade/experiment/reference_metrics.h"
#include "alidade/experiment/run.h"

namespace alidade::internal {

/// State of one estimator during a run.
struct EstimatorRun {
  EstimatorSpec& spec;
  int index = 0;  ///< in the experiment
  Metrics metrics;
  EstimatorResult result;
  bool finished = false;                      ///< it could not continue
  bool diverged = false;                      ///< in a processed frame; not of offline estimators
  bool has_estimate = false;                  ///< so the counts of its measurements are known
  const UpdateReport* last_report = nullptr;  ///< of the last frame; null if it finished earlier
  bool needs_reference = false;               ///< its metrics need the estimates of the reference
  std::vector<Estimate> estimates = {};       ///< if needs_reference
  std::int64_t stale_inputs = 0;              ///< number of all events `input_stale`
  std::vector<char> failed_sensors = {};      ///< under OnPluginFailure::kDisable, or empty

  /// Estimator after a frame.
  struct FrameResult {
    const Estimator& estimator;
    const UpdateReport& report;
    std::optional<double> wall_s;  ///< needed; empty if it processed the frame earlier
  };
  /// Processes the frame without the streams that only failed sensors read. If the estimator
  /// already processed it on arrival, returns that result from `rolled_back`, which is null
  /// otherwise.
  FrameResult Process(const Frame& frame, const std::vector<StreamInfo>& streams,
                      const ProcessedFrame* rolled_back) const;
  /// Disables the sensors whose model failed in the frame of `report`. Returns why the run must
  /// end, or "".
  std::string HandleFailures(const UpdateReport& report);
  /// Adds the estimate of frame `k` to the metrics and passes it to the observers of the run.
  void AddEstimate(std::size_t k, const FrameWithSegments& frame, const State& state,
                   const UpdateReport& report, const RunOptions& options);
  /// Adds the events to the result and the log. Of equal events `input_stale`, it adds only the
  /// first and counts all in `stale_inputs`.
  void AddEvents(const std::vector<Event>& events);
};

/// Returns all estimators of the experiment in their state before the first frame.
std::vector<EstimatorRun> CreateRuns(Experiment& experiment);

}  // namespace alidade::internal
