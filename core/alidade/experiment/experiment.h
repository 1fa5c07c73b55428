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
  kSkip,     ///< omit the measurement
  kDisable,  ///< omit the stream once every sensor of the estimator that reads it has failed
  kAbort,    ///< end the run
};

/// Estimator of a run, with its problem: the config with the overrides of the estimator merged in.
struct EstimatorSpec {
  std::string name;
  std::string type;
  EstimatorKind kind = EstimatorKind::kFilter;
  Problem problem;
  std::unique_ptr<Estimator> estimator;
  OnDivergence on_divergence = OnDivergence::kReport;
  OnPluginFailure on_plugin_failure = OnPluginFailure::kSkip;
  std::string overrides;  ///< from its entry, as YAML, or ""
  /// Index of the earlier online estimator whose accepted measurements this one uses, with those
  /// that initialised a state. -1: this estimator uses all measurements.
  int accepted_by = -1;
};

/// Set of timestamps with separate metrics: those with, or those without, a valid measurement of a
/// sensor.
struct Segment {
  std::string name;
  int stream = -1;
  bool has_measurement = true;  ///< timestamps with one, or those without
  SharedSensor sensor;          ///< determines validity
};

/// Treatment of a frame that is older than a frame that arrived earlier.
enum class OutOfSequence {
  kReject,    ///< estimators receive it at once, and count its measurements as stale
  kBuffer,    ///< frames are buffered while an older one may still arrive
  kRollback,  ///< estimators process frames at once, and roll back for one out of sequence
};

/// Policy for frames that do not arrive in the order of their timestamps. Frames of equal
/// timestamps are merged, except under kReject.
struct OutOfSequencePolicy {
  OutOfSequence policy = OutOfSequence::kReject;
  /// Largest lag behind the newest frame. A frame with a larger lag is dropped, with the event
  /// `out_of_sequence`. Empty: no limit.
  std::optional<Timestamp> window;
  std::vector<int> ranks;  ///< of the streams, to order the measurements of merged frames
};

/// Experiment of a config, created and checked, ready to run.
struct Experiment {
  std::unique_ptr<Source> source;
  std::vector<EstimatorSpec> estimators;
  std::vector<Segment> segments;
  std::uint64_t seed = 1;
  OutOfSequencePolicy out_of_sequence;
  int reference = -1;                ///< index of the reference estimator of the metrics; -1: truth
  const Filter* guide = nullptr;     ///< the filter that guides the source; null: none
  std::vector<double> truth_sigmas;  ///< of the truths; empty: those of the source
};

/// Returns the files and folders under `plugins:`, resolved against the folder of the config.
std::vector<std::filesystem::path> PluginPaths(const Config& config);

/// Returns every key and every scalar of a config. A PluginHost that has the plugins with these
/// names is sufficient for the config.
std::set<std::string> KeysAndScalarsOf(const Config& config);

/// Creates the experiment of a config. Errors: kBadConfig, kPlugin, kInputMissing, ...
Experiment BuildExperiment(const Config& config, const PluginHost& host);

}  // namespace alidade
