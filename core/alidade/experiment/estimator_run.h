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

/// One estimator of a run while it is running.
struct EstimatorRun {
  EstimatorSpec& spec;
  int index = 0;  ///< in the experiment
  Metrics metrics;
  EstimatorResult result;
  bool finished = false;      ///< it had nothing left to go on with
  bool diverged = false;      ///< by a frame that was processed; not of offline estimators
  bool has_estimate = false;  ///< so that its counts are those of the measurements
  const UpdateReport* last_report = nullptr;  ///< of the last frame; null: it was finished before
  bool needs_reference = false;               ///< metrics need the estimates of the reference
  std::vector<Estimate> estimates = {};       ///< if it needs the reference
  std::int64_t stale_inputs = 0;              ///< events `input_stale`, those that are kept too
  std::vector<char> failed_sensors = {};      ///< under OnPluginFailure::kDisable; empty: none

  /// The estimator after a frame.
  struct AfterFrame {
    const Estimator& estimator;
    const UpdateReport& report;
    std::optional<double> wall_s;  ///< that it took; none: it had processed the frame before
  };
  /// Has the estimator process the frame, without the streams that only failed sensors read, unless
  /// it did so when the frame came: `rolled_back`, null if not.
  AfterFrame Process(const Frame& frame, const std::vector<StreamInfo>& streams,
                     const ProcessedFrame* rolled_back) const;
  /// Disables the sensors whose model failed in the frame of `report`. Returns why the run has to
  /// end, or "".
  std::string HandleFailures(const UpdateReport& report);
  /// Adds the estimate of frame `k` to the metrics and shows it to the observers of the run.
  void AddEstimate(std::size_t k, const FrameWithSegments& frame, const State& state,
                   const UpdateReport& report, const RunOptions& options);
  /// Adds the events to the result and the log; of an input that is missing again and again only
  /// the first, and their number to `stale_inputs`.
  void AddEvents(const std::vector<Event>& events);
};

/// All estimators of the experiment before their first frame.
std::vector<EstimatorRun> BeginAll(Experiment& experiment);

}  // namespace alidade::internal
