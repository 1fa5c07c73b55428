// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "alidade/config/config.h"
#include "alidade/estimation/estimator.h"
#include "alidade/estimation/estimator_capabilities.h"
#include "alidade/estimation/problem.h"
#include "alidade/experiment/source.h"
#include "alidade/plugin/plugin_host.h"

namespace alidade {

class Filter;

/// Reaction of the run to Estimator::diverged(). The event `lost` of the metrics, which
/// needs truth, never ends a run.
enum class OnDivergence { kReport, kFail };

/// Reaction of the run to a failed call of a sensor model.
enum class OnPluginFailure {
  kSkip,     ///< the measurement is omitted
  kDisable,  ///< a stream is omitted once every sensor that reads it has failed
  kAbort,    ///< the run ends
};

/// Estimator of a run, with its problem. The estimator's overrides are merged into the config
/// before the problem is read from the config.
struct EstimatorSpec {
  std::string name;
  std::string type;
  EstimatorKind kind = EstimatorKind::kFilter;
  Problem problem;
  std::unique_ptr<Estimator> estimator;
  OnDivergence on_divergence = OnDivergence::kReport;
  OnPluginFailure on_plugin_failure = OnPluginFailure::kSkip;
  bool expects_poor = false;  ///< `expect: poor`: the verdict on the run ignores this estimator
  std::string overrides;      ///< `overrides` in the entry of the estimator as YAML, or ""
  /// Index of an earlier online estimator. This estimator uses only the measurements that the
  /// earlier estimator accepted or used to initialise a state. -1: this estimator uses all
  /// measurements.
  int accepted_by = -1;
};

/// Subset of the timestamps for which metrics are computed separately: those within a range of time
/// at which a sensor has a valid measurement, or has none.
struct Segment {
  std::string name;
  Timestamp first = INT64_MIN, last = INT64_MAX;  ///< both belong to the segment
  SharedSensor sensor =
      nullptr;                  ///< sensor of the condition; null: the range is the only condition
  int stream = -1;              ///< stream of the sensor
  bool has_measurement = true;  ///< true if the sensor has a measurement at all of them
};

/// Treatment of an out-of-sequence frame, which is older than a frame that arrived earlier.
enum class OutOfSequence {
  kReject,  ///< estimators receive the frame at once, and count its measurements as stale
  kBuffer,  ///< frames are buffered as long as an older frame may still arrive
  /// Estimators process each frame at once, and roll back if a frame is out of sequence.
  kRollback,
};

/// Policy for frames that do not arrive in the order of their timestamps. Frames with equal
/// timestamps are merged, except under kReject.
struct OutOfSequencePolicy {
  OutOfSequence policy = OutOfSequence::kReject;
  /// Largest accepted lag behind the newest frame. A frame with a larger lag is dropped, and the
  /// event `out_of_sequence` reports this. nullopt: no limit.
  std::optional<Timestamp> window;
  std::vector<int> ranks;  ///< rank of each stream, by which merged measurements are sorted
};

/// Experiment that was built from a config and checked, and is ready to run.
struct Experiment {
  std::optional<Config> config;  ///< the config with expanded short forms (ExpandShortForms)
  std::unique_ptr<Source> source;
  std::vector<EstimatorSpec> estimators;
  std::vector<Segment> segments;
  std::uint64_t seed = 1;
  OutOfSequencePolicy out_of_sequence;
  int reference = -1;  ///< index of the estimator that is the reference of the metrics; -1: truth
  const Filter* guide = nullptr;         ///< filter that guides the source; null without a guide
  std::vector<std::string> report_rows;  ///< `report.rows`: keys of the main rows, see MetricKey
  std::vector<double> truth_sigmas;      ///< sigma of each truth; if empty, the source defines them
};

/// Returns the files and folders under `plugins:`, resolved against the folder of the config.
std::vector<std::filesystem::path> PluginPaths(const Config& config);

/// Returns every key and every scalar of a config. A PluginHost that loads only plugins with these
/// names is sufficient for the config.
std::set<std::string> KeysAndScalarsOf(const Config& config);

/// Creates the experiment that a config describes. Errors: kBadConfig, kPlugin, kInputMissing, and
/// others.
Experiment BuildExperiment(const Config& written, const PluginHost& host);

}  // namespace alidade
