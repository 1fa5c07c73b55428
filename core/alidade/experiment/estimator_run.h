// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "alidade/diagnosis/measurement_log.h"
#include "alidade/estimation/rollback.h"
#include "alidade/experiment/metrics.h"
#include "alidade/experiment/reference_metrics.h"
#include "alidade/experiment/run.h"

namespace alidade::internal {

/// State of one estimator during a run.
struct EstimatorRun {
  EstimatorSpec& spec;
  int index = 0;  ///< index in Experiment::estimators
  Metrics metrics;
  MeasurementLog measurement_log;
  EstimatorResult result;
  bool finished = false;  ///< true if the estimator could not continue
  /// True if the estimator diverged in a processed frame. Always false for an offline estimator.
  bool diverged = false;
  bool has_estimate = false;  ///< true if the counts of measurements are known
  /// Report of the last frame; null if the estimator finished earlier.
  const UpdateReport* last_report = nullptr;
  bool needs_reference = false;  ///< true if the metrics need the estimates of the reference
  std::vector<Estimate> estimates = {};  ///< filled only if needs_reference is true
  std::int64_t stale_inputs = 0;         ///< total number of events `input_stale`
  /// One element per sensor, which is nonzero if the sensor has failed. The list is empty until a
  /// sensor fails under OnPluginFailure::kDisable.
  std::vector<char> failed_sensors = {};

  /// Result of processing a frame: the estimator after the frame, and the report of the frame.
  struct FrameResult {
    const Estimator& estimator;
    const UpdateReport& report;
    /// Wall-clock time of the frame; nullopt if the frame was processed earlier.
    std::optional<double> wall_s;
  };
  /// Processes the frame without the streams that only failed sensors read. If the estimator
  /// already processed the frame on arrival, `rolled_back` is the result of this, and the function
  /// returns `rolled_back`. Otherwise `rolled_back` is null.
  FrameResult Process(const Frame& frame, const std::vector<StreamInfo>& streams,
                      const ProcessedFrame* rolled_back) const;
  /// Disables the sensors whose model failed in the frame of `report`. Returns the reason why the
  /// run must end, or "" if the run can continue.
  std::string HandleFailures(const UpdateReport& report);
  /// Adds the estimate of frame `k` to the metrics and the measurement log, and passes it to the
  /// observers of the run.
  void AddEstimate(std::size_t k, const FrameWithSegments& frame, const State& state,
                   const UpdateReport& report, const RunOptions& options);
  /// Adds the events to the result and the log. Counts all events `input_stale` in `stale_inputs`.
  /// Of several equal events `input_stale`, adds only the first.
  void AddEvents(const std::vector<Event>& events);
};

/// Returns an EstimatorRun for each estimator of the experiment, in its state before the first
/// frame.
std::vector<EstimatorRun> CreateRuns(Experiment& experiment);

}  // namespace alidade::internal
