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

/// What Estimator::diverged() does to the run. The event `inconsistent` of the metrics, which takes
/// truth, never ends one.
enum class OnDivergence { kReport, kFail };

/// What a call of a sensor that fails does: that measurement is left out; so are all of its stream
/// from then on, once every sensor of the estimator on it has failed; the run ends.
enum class OnPluginFailure { kSkip, kDisable, kAbort };

/// One estimator to be run, on its own problem: the config with its overrides merged in.
struct EstimatorSpec {
  std::string name;
  std::string type;
  EstimatorKind kind = EstimatorKind::kFilter;
  Problem problem;
  std::unique_ptr<Estimator> estimator;
  OnDivergence on_divergence = OnDivergence::kReport;
  OnPluginFailure on_plugin_failure = OnPluginFailure::kSkip;
  std::string overrides;  ///< of its entry, as YAML; "": none
  /// Index of an estimator before it, not an offline one: it sees the measurements alone that this
  /// one accepted or took as first values. -1: it sees all.
  int accepted_by = -1;
};

/// A share of the timestamps over which metrics are taken separately: those with (or without) a
/// valid measurement of a sensor.
struct Segment {
  std::string name;
  int stream = -1;
  bool with = true;     ///< timestamps with one, or timestamps without
  SharedSensor sensor;  ///< decides validity
};

/// What is done with a frame whose timestamp is before that of a frame that came earlier.
enum class OutOfSequence {
  kReject,    ///< estimators are given it as it comes, and count its measurements as stale
  kBuffer,    ///< frames are held back while one before them can still come
  kRollback,  ///< estimators take frames as they come, and roll back for one out of sequence
};

/// How a run takes frames that are not in the order of their timestamps. But under kReject, frames
/// of equal timestamps are merged.
struct OutOfSequencePolicy {
  OutOfSequence policy = OutOfSequence::kReject;
  /// A frame farther behind the newest is dropped, with the event `out_of_sequence`; none: no frame
  /// is.
  std::optional<Timestamp> window;
  std::vector<int> ranks;  ///< of the streams, among the measurements of merged frames
};

/// All that a config describes, made and checked, ready to run.
struct Experiment {
  std::unique_ptr<Source> source;
  std::vector<EstimatorSpec> estimators;
  std::vector<Segment> segments;
  std::uint64_t seed = 1;
  OutOfSequencePolicy out_of_sequence;
  int reference = -1;             ///< index of the estimator that metrics compare with; -1: truth
  const Filter* guide = nullptr;  ///< the filter that guides the source; null: none
  std::vector<double> truth_sigmas;  ///< StreamInfo::sigma of the source's truths; empty: its own
};

/// The files and folders that a config's `plugins:` names, relative ones taken from its folder.
std::vector<std::filesystem::path> PluginPaths(const Config& config);

/// Every key and every scalar of a config: with these alone a PluginHost has what it names.
std::set<std::string> WordsOf(const Config& config);

/// Makes everything a config names. Errors: kBadConfig, kPlugin, kInputMissing, ...
Experiment BuildExperiment(const Config& config, const PluginHost& host);

}  // namespace alidade
