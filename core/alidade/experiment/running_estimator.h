// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "alidade/experiment/metrics.h"
#include "alidade/experiment/reference_metrics.h"
#include "alidade/experiment/run.h"

namespace alidade::internal {

/// One estimator on its way through a run.
struct Running {
  NamedEstimator& named;
  int index = 0;  ///< in the experiment
  Metrics metrics;
  EstimatorResult result;
  bool ended = false;                  ///< it had nothing left to go on with
  bool diverged = false;               ///< by a frame that was taken; not of offline estimators
  bool took = false;                   ///< an estimate, so that its counts tell of the measurements
  const UpdateReport* last = nullptr;  ///< report of the last frame; null: it had ended before
  bool waits = false;                  ///< metrics need the estimates of the reference
  std::vector<Estimate> estimates = {};   ///< where it waits
  std::int64_t stale_inputs = 0;          ///< events `input_stale`, those that are kept too
  std::vector<char> failed_sensors = {};  ///< under OnPluginFailure::kDisable; empty: none

  /// Looks for calls that failed in a report of a frame. Why the run has to end; "" where it goes
  /// on.
  std::string TakeFailures(const UpdateReport& report);

  /// Puts the estimate of frame k into metrics and record, and shows it to who observes the run.
  void Take(std::size_t k, const Seen& seen, const State& state, const UpdateReport& report,
            const RunOptions& options);
  /// Keeps the events; of each input that is missing again and again the first alone, and how often
  /// that was.
  void Note(const std::vector<Event>& events);
};

/// The frame without the streams that failed sensors of `one` alone read.
Frame WithoutFailed(const Running& one, const Frame& frame, const std::vector<StreamInfo>& streams);

/// What is known of the estimator before its first frame.
EstimatorResult Begin(const NamedEstimator& named);

/// An event `unit` for each sensor whose measurements are far from all that it predicts.
void NoteUnits(const System& system, const Metrics& metrics, EstimatorResult& result);

/// An event `nees_bounds` or `nis_bounds` for each mean of NEES or NIS outside its 95 % bounds.
void NoteConsistency(EstimatorResult& result);

/// An event `truth` where no frame had the truth that the source names.
void NoteTruths(const Metrics& metrics, EstimatorResult& result);

/// An event `unused` for each sensor of which the whole run used no measurement; `accepted_by`
/// names the filter that chose them, or is empty.
void NoteUnused(const System& system, const std::string& accepted_by, EstimatorResult& result);

}  // namespace alidade::internal
