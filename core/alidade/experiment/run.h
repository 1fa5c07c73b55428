// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "alidade/experiment/experiment.h"

namespace alidade {

/// How the frames of a run came.
struct Arrivals {
  std::int64_t out_of_sequence = 0;  ///< before one that came earlier
  std::int64_t merged = 0;           ///< into another of the same timestamp
  std::int64_t dropped = 0;          ///< of those out of sequence: beyond the window
  Timestamp longest_lag = 0;         ///< of one of those behind the newest, ns
};

enum class RunStatus { kOk, kStopped, kFailed };
/// `ok`, `stopped`, `failed`, as in run.json.
const char* ToString(RunStatus status);

/// One estimator and its outcome, at the end of a run.
struct EstimatorResult {
  std::string name, type;
  EstimatorKind kind = EstimatorKind::kFilter;
  bool smoothed = false;    ///< its estimates depend on later data too
  std::string accepted_by;  ///< the estimator that chose its measurements, or ""
  std::string overrides;    ///< of the config, as YAML, or ""
  std::vector<std::string> sensors;
  std::string position_block;  ///< the block of a position that landmarks are seen from, or ""
  std::map<std::string, double> metrics;       ///< as in docs/metrics.md
  std::map<std::string, std::int64_t> counts;  ///< `accepted:stereo`
  std::map<std::string, std::string> units;    ///< of blocks, {"target.depth", "m"}; may lack some
  bool diverged = false;                       ///< the estimator said so
  bool inconsistent = false;                   ///< its error was; the event of that name
  bool failed = false;                         ///< it diverged, or had nothing to go on with
  std::vector<Event> events;
  std::vector<std::vector<std::string>> unobservable;
  /// The map at the end, for `landmarks.csv`; none where the estimator has no landmarks at all.
  std::optional<std::vector<LandmarkEstimate>> landmarks;
  /// Landmarks that were removed during the run, in the order of that, as they were then.
  std::vector<LandmarkEstimate> removed_landmarks;
  /// Time of the wall clock that its frames and smoothing took; not under kRollback.
  double wall_s = 0.0;
  /// Of that, what filters with landmarks tell of their parts, by FramePart.
  std::array<double, kFrameParts> parts_s{};
  double record_s = 0.0;  ///< time that its metrics and its records took besides
};

struct RunResult {
  RunStatus status = RunStatus::kOk;
  ExitCode code = ExitCode::kOk;
  std::string reason;
  std::int64_t frames = 0;
  Arrivals arrivals;
  /// Quaternions and directions of a stream or truth that were brought to unit length.
  std::map<std::string, std::int64_t> normalised;
  std::string reference = "truth";  ///< what metrics compare with: truth, or an estimator's name
  std::string withheld;             ///< why there is no comparison with that estimator, or ""
  std::vector<EstimatorResult> estimators;
};

/// Follows a run on its own thread. What it throws ends the run, and is its reason.
class RunObserver {
 public:
  virtual ~RunObserver() = default;
  /// Once, before the first frame.
  virtual void Begin(const Experiment& /*experiment*/) {}
  /// Each frame before the estimators take it; the truth they are not given.
  virtual void OnFrame(const SourceFrame& /*frame*/) {}
  /// The wall clock that an estimator needed for a frame; before its estimate, if there is one, and
  /// not under kRollback.
  virtual void OnTime(int /*estimator*/, double /*wall_s*/) {}
  /// Each estimate as it is made, with the index of its estimator; those of an offline estimator
  /// after the last frame.
  virtual void OnEstimate(int /*estimator*/, const SourceFrame& /*frame*/, const State& /*state*/,
                          const UpdateReport& /*report*/) {}
};

struct RunOptions {
  std::vector<RunObserver*> observers;  ///< given all that happens, in this order
  std::function<void(std::int64_t, std::int64_t)> progress;  ///< frames done, frames in all or -1
  std::function<bool()> stop;                                ///< true: finish the frame and stop
};

/// Runs all estimators over the source, frame by frame, so that all see the same data. Data errors
/// and divergence under `fail` end the run early; an estimator that has nothing left to go on with
/// ends by itself; a frame that is not as the source's streams() and truths() say ends the run, as
/// does a quaternion or direction that is not of unit length to 1e-3. All that, and whatever else
/// goes wrong, is in the result; nothing is thrown.
RunResult Run(Experiment& experiment, const RunOptions& options);

/// A table of the estimators' main metrics, one column each, for a terminal; below it what they
/// compare with, where that is not truth.
std::string ComparisonTable(const RunResult& result);

}  // namespace alidade
