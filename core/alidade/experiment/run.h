// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "alidade/diagnosis/verdict.h"
#include "alidade/experiment/experiment.h"
#include "alidade/io/wrap_text.h"

namespace alidade {

/// Statistics of the arrival order of the frames of a run.
struct Arrivals {
  std::int64_t out_of_sequence = 0;  ///< frames that are older than a frame that arrived earlier
  std::int64_t merged = 0;    ///< frames that were merged into a frame with the same timestamp
  std::int64_t dropped = 0;   ///< out-of-sequence frames that were older than the window allows
  Timestamp longest_lag = 0;  ///< largest lag behind the newest frame, ns
};

enum class RunStatus { kOk, kStopped, kFailed };
/// Returns `ok`, `stopped` or `failed`, as in run.json.
const char* ToString(RunStatus status);

/// Result of one estimator at the end of a run.
struct EstimatorResult {
  std::string name, type;
  EstimatorKind kind = EstimatorKind::kFilter;
  bool smoothed = false;    ///< whether estimates also depend on later data
  std::string accepted_by;  ///< estimator whose accepted measurements this one used, or ""
  std::string overrides;    ///< `overrides` of the config entry as YAML, or ""
  std::vector<std::string> sensors;
  std::string position_block;             ///< position from which landmarks are observed, or ""
  std::map<std::string, double> metrics;  ///< values by key; docs/metrics.md lists the keys
  std::map<std::string, std::int64_t> counts;  ///< counts by key, such as `accepted:stereo`
  /// Unit of each block that has a unit, such as {"target.depth", "m"}.
  std::map<std::string, std::string> units;
  bool diverged = false;  ///< whether the estimator reported that it diverged
  bool failed = false;    ///< whether it diverged, or could not continue
  Verdict verdict;
  bool expects_poor = false;      ///< whether the config expects poor estimates (`expect: poor`)
  std::vector<Finding> findings;  ///< about the innovations of its sensors
  std::vector<Event> events;
  std::vector<std::vector<std::string>> unobservable;
  /// Final map, for `landmarks.csv`; nullopt if the estimator has no landmarks.
  std::optional<std::vector<LandmarkEstimate>> landmarks;
  /// Landmarks that were removed during the run, in the order of removal, with their last
  /// estimates.
  std::vector<LandmarkEstimate> removed_landmarks;
  /// Wall-clock time that the estimator needed for all frames and for smoothing, s. Zero under
  /// kRollback.
  double wall_s = 0.0;
  /// Parts of `wall_s` by FramePart, s. Only filters with landmarks report these parts.
  std::array<double, kFrameParts> parts_s{};
  double record_s = 0.0;  ///< additional time for metrics and records, s
};

/// Result of a run.
struct RunResult {
  RunStatus status = RunStatus::kOk;
  ExitCode code = ExitCode::kOk;
  std::string reason;
  std::int64_t frames = 0;
  Arrivals arrivals;
  /// Number of quaternions and directions that were normalised, by stream or truth.
  std::map<std::string, std::int64_t> normalised;
  std::string reference = "truth";  ///< reference of the metrics: `truth`, or an estimator
  std::string withheld;  ///< reason why the comparison with the reference is omitted, or ""
  std::vector<EstimatorResult> estimators;
};

/// Returns the worst verdict of the estimators from which the config does not expect poor
/// estimates; nullopt if the config expects this of all.
std::optional<VerdictState> WorstVerdict(const RunResult& result);
/// Returns a line for each estimator with its verdict and the reason, and a line for each finding
/// about its innovations.
std::string VerdictText(const RunResult& result);

/// Observer of a run, called on the thread of the run. If the observer throws an exception, the run
/// ends with this exception as its reason.
class RunObserver {
 public:
  virtual ~RunObserver() = default;
  /// Called once, before the first frame.
  virtual void Begin(const Experiment& /*experiment*/) {}
  /// Called for each frame before the estimators process it. The estimators do not receive the
  /// truth.
  virtual void OnFrame(const SourceFrame& /*frame*/) {}
  /// Called before OnEstimate with the wall-clock time that an estimator needed for a frame. Not
  /// called under kRollback.
  virtual void OnTime(int /*estimator*/, double /*wall_s*/) {}
  /// Called for each estimate with the index of its estimator. For an offline estimator, all calls
  /// occur after the last frame.
  virtual void OnEstimate(int /*estimator*/, const SourceFrame& /*frame*/, const State& /*state*/,
                          const UpdateReport& /*report*/) {}
};

/// Options of a run.
struct RunOptions {
  std::vector<RunObserver*> observers;  ///< observers, which are called in this order
  /// Called after each frame with the number of processed frames and the total number of frames,
  /// which is -1 if it is unknown.
  std::function<void(std::int64_t, std::int64_t)> progress;
  std::function<bool()> stop;  ///< returns true to stop after the current frame
};

/// Runs all estimators on the source, frame by frame, so all process the same data. The run ends
/// early after an error in the data, or after a divergence under `on_divergence: fail`. If an
/// estimator cannot continue, the other estimators continue. A frame that contradicts streams() or
/// truths() of the source ends the run. A quaternion or direction whose length differs from 1 by
/// more than 1e-3 also ends the run. The result reports all errors; the function does not throw.
RunResult Run(Experiment& experiment, const RunOptions& options);

/// Returns a table of the main metrics for a terminal of this width, with one column for each
/// estimator. If the reference is not truth, a line below the table names the reference.
std::string ComparisonTable(const RunResult& result,
                            std::size_t width = internal::kDefaultTextWidth);

}  // namespace alidade
