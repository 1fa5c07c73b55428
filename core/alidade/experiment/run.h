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

/// Statistics of the arrival order of the frames of a run.
struct Arrivals {
  std::int64_t out_of_sequence = 0;  ///< frames that are older than an earlier frame
  std::int64_t merged = 0;           ///< frames merged into one of the same timestamp
  std::int64_t dropped = 0;          ///< out-of-sequence frames beyond the window
  Timestamp longest_lag = 0;         ///< largest lag behind the newest frame, ns
};

enum class RunStatus { kOk, kStopped, kFailed };
/// Returns `ok`, `stopped` or `failed`, as in run.json.
const char* ToString(RunStatus status);

/// Result of one estimator at the end of a run.
struct EstimatorResult {
  std::string name, type;
  EstimatorKind kind = EstimatorKind::kFilter;
  bool smoothed = false;    ///< whether its estimates also depend on later data
  std::string accepted_by;  ///< the estimator that selected its measurements, or ""
  std::string overrides;    ///< from the config, as YAML, or ""
  std::vector<std::string> sensors;
  std::string position_block;             ///< position from which landmarks are observed, or ""
  std::map<std::string, double> metrics;  ///< as in docs/metrics.md
  std::map<std::string, std::int64_t> counts;  ///< with keys such as `accepted:stereo`
  std::map<std::string, std::string> units;    ///< of blocks, {"target.depth", "m"}; incomplete
  bool diverged = false;                       ///< as the estimator reported
  bool inconsistent = false;                   ///< whether it has an event of that name
  bool failed = false;                         ///< it diverged, or could not continue
  std::vector<Event> events;
  std::vector<std::vector<std::string>> unobservable;
  /// Final map, for `landmarks.csv`; empty if the estimator has no landmarks.
  std::optional<std::vector<LandmarkEstimate>> landmarks;
  /// Landmarks removed during the run, in the order of removal, with their last estimates.
  std::vector<LandmarkEstimate> removed_landmarks;
  /// Wall-clock time of its frames and its smoothing; zero under kRollback.
  double wall_s = 0.0;
  /// Shares of `wall_s` by FramePart, which filters with landmarks report.
  std::array<double, kFrameParts> parts_s{};
  double record_s = 0.0;  ///< additional time of its metrics and records
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
  std::string reference = "truth";  ///< of the metrics: truth, or an estimator
  std::string withheld;             ///< why the comparison with that estimator is omitted, or ""
  std::vector<EstimatorResult> estimators;
};

/// Observer of a run, called on the thread of the run. An exception that it throws ends the run and
/// becomes its reason.
class RunObserver {
 public:
  virtual ~RunObserver() = default;
  /// Called once, before the first frame.
  virtual void Begin(const Experiment& /*experiment*/) {}
  /// Called for each frame before the estimators process it. They do not receive the truth.
  virtual void OnFrame(const SourceFrame& /*frame*/) {}
  /// Called with the wall-clock time that an estimator needed for a frame, before OnEstimate. Not
  /// called under kRollback.
  virtual void OnTime(int /*estimator*/, double /*wall_s*/) {}
  /// Called for each estimate with the index of its estimator; for an offline estimator, after the
  /// last frame.
  virtual void OnEstimate(int /*estimator*/, const SourceFrame& /*frame*/, const State& /*state*/,
                          const UpdateReport& /*report*/) {}
};

/// Options of a run.
struct RunOptions {
  std::vector<RunObserver*> observers;                       ///< called in this order
  std::function<void(std::int64_t, std::int64_t)> progress;  ///< frames processed, total or -1
  std::function<bool()> stop;                                ///< true: finish the frame, then stop
};

/// Runs all estimators on the source, frame by frame, so that all process the same data. Data
/// errors, and divergence under `fail`, end the run early. An estimator that cannot continue ends
/// alone. A frame that contradicts streams() or truths() of the source ends the run. So does a
/// quaternion or direction whose length differs from 1 by more than 1e-3. The result reports all
/// errors; the function does not throw.
RunResult Run(Experiment& experiment, const RunOptions& options);

/// Returns a table of the main metrics for a terminal, with one column for each estimator. Names
/// the reference below the table if it is not truth.
std::string ComparisonTable(const RunResult& result);

}  // namespace alidade
