// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "alidade/config.h"
#include "alidade/estimator.h"
#include "alidade/plugin_host.h"
#include "alidade/system.h"

namespace alidade {

/// What Estimator::diverged() does to the run. The event `inconsistent` of the metrics, which takes
/// truth, never ends one.
enum class OnDivergence { kReport, kFail };

/// One estimator of a run, on its own system (the config with the estimator's overrides merged in).
struct NamedEstimator {
  std::string name;
  std::string type;
  System system;
  std::unique_ptr<Estimator> estimator;
  OnDivergence on_divergence = OnDivergence::kReport;
  std::string overrides;  ///< of its entry, as YAML; "": none
  /// Index of an estimator before it, not an offline one: it sees the measurements alone that this
  /// one accepted or took as first values. -1: it sees all.
  int accepted_by = -1;
};

/// A share of the stamps over which metrics are taken apart: those with (or without) a valid
/// measurement of a sensor.
struct Segment {
  std::string name;
  int stream = -1;
  bool with = true;    ///< stamps with one, or stamps without
  SensorModel sensor;  ///< decides validity
};

/// What is done with a frame whose stamp is before that of a frame that came earlier.
enum class TimeOrder {
  kReject,  ///< estimators are given it as it comes, and count its measurements as stale
  kSort,    ///< frames are held back while one before them can still come
  kRewind,  ///< as kSort, but estimators take frames as they come, and go back for a late one
};

/// How a run takes frames that are not in the order of their stamps. But under kReject, frames of
/// equal stamps are merged.
struct TimePolicy {
  TimeOrder order = TimeOrder::kReject;
  /// A frame farther behind the newest is dropped, with the event `late`; none: no frame is.
  std::optional<Stamp> window;
  std::vector<int> ranks;  ///< of the streams, among the measurements of merged frames
};

/// All that a config describes, made and checked, ready to run.
struct Experiment {
  std::unique_ptr<Source> source;
  std::vector<NamedEstimator> estimators;
  std::vector<Segment> segments;
  std::uint64_t seed = 1;
  TimePolicy time;
  int reference = -1;  ///< index of the estimator that metrics compare with; -1: truth
  std::vector<double> truth_sigmas;  ///< StreamInfo::sigma of the source's truths; empty: its own
};

/// How the frames of a run came.
struct Arrivals {
  std::int64_t late = 0;     ///< before one that came earlier
  std::int64_t merged = 0;   ///< into another of the same stamp
  std::int64_t dropped = 0;  ///< of the late ones: beyond the window
  Stamp longest_lag = 0;     ///< of a late one behind the newest, ns
};

/// The files and folders that a config's `plugins:` names, relative ones taken from its folder.
std::vector<std::filesystem::path> PluginPaths(const Config& config);

/// Makes everything a config names. Errors: kBadConfig, kPlugin, kInputMissing, ...
Experiment BuildExperiment(const Config& config, const PluginHost& host);

enum class RunStatus { kOk, kStopped, kFailed };
/// `ok`, `stopped`, `failed`, as in run.json.
const char* ToString(RunStatus status);

/// What became of one estimator.
struct EstimatorResult {
  std::string name;
  std::map<std::string, double> metrics;       ///< as in docs/run_folder.md
  std::map<std::string, std::int64_t> counts;  ///< `accepted:stereo`
  std::map<std::string, std::string> units;    ///< of blocks, {"target.depth", "m"}; may lack some
  bool diverged = false;                       ///< the estimator said so
  bool inconsistent = false;                   ///< its error was; the event of that name
  bool failed = false;                         ///< it diverged, or had nothing to go on with
  std::vector<Event> events;
  std::vector<std::vector<std::string>> unobservable;
  /// The map at the end, for `landmarks.csv`; none where the estimator has no landmarks at all.
  std::optional<std::vector<LandmarkEstimate>> landmarks;
  /// Time of the wall clock that its frames and smoothing took; not under kRewind.
  double wall_s = 0.0;
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

class Recorder;

struct RunOptions {
  Recorder* recorder = nullptr;                     ///< null: nothing is written
  std::function<void(const Frame&)> observe_frame;  ///< given each frame as it is used; or empty
  /// Given each estimate as the recorder is, with the index of its estimator; may be empty.
  std::function<void(int, const Frame&, const State&, const UpdateReport&)> observe;
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
