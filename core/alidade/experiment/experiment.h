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

/// Reaction of the run to Estimator::diverged(). The event `inconsistent` of the metrics, which
/// needs truth, never ends a run.
enum class OnDivergence { kReport, kFail };

/// Reaction of the run to a failed call of a sensor model.
enum class OnPluginFailure {
  kSkip,     ///< the measurement is omitted
  kDisable,  ///< a stream is omitted once every sensor that reads it has failed
  kAbort,    ///< the run ends
};

/// Estimator of a run, with its problem. The problem is read from the config after the estimator's
/// overrides were merged into it.
struct EstimatorSpec {
  std::string name;
  std::string type;
  EstimatorKind kind = EstimatorKind::kFilter;
  Problem problem;
  std::unique_ptr<Estimator> estimator;
  OnDivergence on_divergence = OnDivergence::kReport;
  OnPluginFailure on_plugin_failure = OnPluginFailure::kSkip;
  std::string overrides;  ///< `overrides` of its entry as YAML, or ""
  /// Index of the earlier online estimator that selects the measurements: this estimator uses only
  /// those that the other accepted or used to initialise a state. -1: it uses all measurements.
  int accepted_by = -1;
};

/// Set of timestamps for which metrics are also computed: the timestamps with, or without, a valid
/// measurement of one sensor.
struct Segment {
  std::string name;
  int stream = -1;
  bool has_measurement = true;  ///< true: timestamps with a measurement; false: those without
  SharedSensor sensor;          ///< sensor that determines whether a measurement is valid
};

/// How to treat a frame that is older than a frame that arrived earlier.
enum class OutOfSequence {
  kReject,  ///< estimators receive the frame at once, and count its measurements as stale
  kBuffer,  ///< frames are buffered as long as an older frame may still arrive
  /// Estimators process each frame at once, and roll back if a frame is out of sequence.
  kRollback,
};

/// Policy for frames that do not arrive in the order of their timestamps. Frames of equal
/// timestamps are merged, except under kReject.
struct OutOfSequencePolicy {
  OutOfSequence policy = OutOfSequence::kReject;
  /// Largest lag behind the newest frame. A frame with a larger lag is dropped, with the event
  /// `out_of_sequence`. Empty: no limit.
  std::optional<Timestamp> window;
  std::vector<int> ranks;  ///< rank of each stream, which orders the measurements of merged frames
};

/// Experiment that was built from a config and checked, and is ready to run.
struct Experiment {
  std::unique_ptr<Source> source;
  std::vector<EstimatorSpec> estimators;
  std::vector<Segment> segments;
  std::uint64_t seed = 1;
  OutOfSequencePolicy out_of_sequence;
  int reference = -1;  ///< index of the estimator that is the reference of the metrics; -1: truth
  const Filter* guide = nullptr;     ///< filter that guides the source; null if no filter does
  std::vector<double> truth_sigmas;  ///< sigma of each truth; empty: the sigmas of the source
};

/// Returns the files and folders under `plugins:`, resolved against the folder of the config.
std::vector<std::filesystem::path> PluginPaths(const Config& config);

/// Returns every key and every scalar of a config. A PluginHost that loads only plugins with these
/// names is sufficient for the config.
std::set<std::string> KeysAndScalarsOf(const Config& config);

/// Creates the experiment of a config. Errors: kBadConfig, kPlugin, kInputMissing, ...
Experiment BuildExperiment(const Config& config, const PluginHost& host);

}  // namespace alidade
