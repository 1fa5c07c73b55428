// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "alidade/base/statistics.h"
#include "alidade/experiment/run.h"
#include "alidade/sweep/named_values.h"

namespace alidade {

namespace internal {
class FinishedRuns;  // declared in alidade/sweep/finished_runs.h
class OutputFolder;  // declared in alidade/io/output_folder.h
}  // namespace internal

/// One of `count` parts of a sweep, with consecutive seeds. The sizes of two shards differ by at
/// most one.
struct Shard {
  int index = 1;  ///< index, from 1 to count
  int count = 1;
};

struct SweepOptions {
  std::int64_t runs = 1;         ///< total number of runs of all shards
  std::uint64_t first_seed = 1;  ///< seed of the first run; each further run has the next seed
  /// Number of threads. 0: one thread for each processor that the process may use. Only one thread
  /// is used if any loaded model lacks ALIDADE_THREAD_INSTANCES (several instances at once).
  int jobs = 0;
  std::optional<Shard> shard = {};  ///< the shard to run; nullopt: all runs
  /// Function that executes a run. Several threads call it at once. If it is empty, alidade::Run()
  /// is called.
  std::function<RunResult(Experiment&, const RunOptions&)> run;
  /// Receives the number of finished runs and the number of all runs.
  std::function<void(std::int64_t, std::int64_t)> progress;
  /// Receives the number of finished frames and of all frames of the first run, until a run is
  /// finished.
  std::function<void(std::int64_t, std::int64_t)> first_run_progress;
  std::function<bool()> stop;  ///< if it returns true, unfinished runs are discarded
  /// Record of finished runs, from SweepFolder::finished(). Recorded runs are not repeated, and new
  /// runs are added. If it is null, every run is executed.
  internal::FinishedRuns* finished = nullptr;
  std::string value = {};  ///< value of the varied key, for `finished`
};

/// RMS of the innovations z - h of one landmark sensor in each frame. The first entry belongs to
/// the first frame.
struct FrameErrors {
  std::string estimator, sensor, unit;
  std::vector<double> rms;  ///< NaN for a frame without innovations
};

/// A row of runs.csv: the values of one EstimatorResult. Rows whose values have the same
/// names share one list of names.
struct SweepRow {
  SweepRow() = default;
  explicit SweepRow(const EstimatorResult& result)
      : name(result.name),
        metrics(result.metrics),
        counts(result.counts),
        units(result.units),
        verdict(result.verdict.state),
        diverged(result.diverged),
        failed(result.failed) {}

  std::string name;
  NamedValues<double> metrics;
  NamedValues<std::int64_t> counts;
  NamedValues<std::string> units;
  VerdictState verdict = VerdictState::kNotTested;
  bool diverged = false;
  bool failed = false;
};

/// One run of a sweep.
struct SweepRun {
  std::uint64_t seed = 0;
  RunStatus status = RunStatus::kOk;
  ExitCode code = ExitCode::kOk;
  std::string reason;
  std::vector<SweepRow> estimators;
  std::vector<FrameErrors> reprojection = {};  ///< first 500 frames; only in a varied sweep
  bool withheld = false;  ///< true: the comparison with the reference is withheld, see RunResult

  /// Replaces the lists of names of all estimators by equal lists in the pool.
  void ShareNames(SharedNames& pool) {
    for (SweepRow& row : estimators) {
      row.metrics.ShareNames(pool);
      row.counts.ShareNames(pool);
      row.units.ShareNames(pool);
    }
  }
  /// Returns true if summaries use the metrics of `row`, that is, if the run finished and the
  /// estimator did not diverge.
  bool UsesMetricsOf(const SweepRow& row) const {
    return status == RunStatus::kOk && !row.diverged;
  }
};

struct SweepResult {
  std::int64_t runs = 0;  ///< number of requested runs of this shard
  std::uint64_t first_seed = 1;
  bool stopped = false;
  std::string reference = "truth";      ///< reference of the errors, as in RunResult
  std::vector<std::string> estimators;  ///< names, in the order of the config
  std::vector<SweepRun> done;           ///< runs sorted by seed, including failed runs
};

/// Runs `config` once for each seed (key `source.seed`), in memory. Each run is built from a
/// separate copy of the config. Results do not depend on the number of threads. A run in which an
/// estimator diverges continues, even with `on_divergence: fail`. A failure ends only the run in
/// which it occurs. Errors: those of BuildExperiment, before the first run; kIo if a finished run
/// cannot be written.
SweepResult Sweep(const Config& config, const PluginHost& host, const SweepOptions& options);

/// Varied keys of the config, and the values of these keys. In a run, all varied keys have the same
/// value.
struct Variation {
  /// Part of the run for which the keys are varied.
  enum class Scope {
    kConfig,      ///< the whole run, including the source; option --vary
    kEstimators,  ///< `overrides` of every estimator, not the source; option --vary-filter
  };

  std::string key;                  ///< dotted key, as for Config::Set(), or `KEY+KEY`
  std::vector<std::string> values;  ///< values, each in YAML
  Scope scope = Scope::kConfig;

  /// Parses `KEY=v1,v2,v3` or `KEY+KEY=v1,v2,v3`. A comma inside brackets, braces or quotes belongs
  /// to the value. Error: kUsage if a key or a value is missing or repeated, or a bracket is not
  /// closed.
  static Variation FromText(const std::string& text, Scope scope = Scope::kConfig);
  /// Returns the name of the option that determines the scope.
  static const char* OptionOf(Scope scope);
  /// Returns the list of keys.
  std::vector<std::string> Keys() const;
  /// Sets all keys to the value. Errors: those of Config::Set.
  void Set(Config& config, const std::string& value) const;
};

/// Sweeps with the same seeds, one for each value.
struct VariedSweep {
  Variation variation;
  std::vector<SweepResult> results;  ///< one for each value; fewer if the sweep was stopped
  /// Warning that a varied key outside `source` also changes the data of the source; "": it does
  /// not.
  std::string warning = {};

  bool stopped() const { return !results.empty() && results.back().stopped; }
};

/// Executes a sweep of `config` for each value of the variation. `options.progress` counts the runs
/// of all values. Logs VariedSweep::warning before the first run. Errors before the first run:
/// kBadConfig if the key is `source.seed`, if the parent map of the key does not exist, or if the
/// values lead to different estimators; those of BuildExperiment() for each value.
VariedSweep SweepVariation(const Config& config, const PluginHost& host,
                           const SweepOptions& options, const Variation& variation);

/// Metrics of one estimator over all runs.
struct SweepSummary {
  std::string name;
  std::int64_t used = 0;      ///< number of runs whose metrics are used
  std::int64_t diverged = 0;  ///< number of runs in which the estimator diverged; not used
  /// Number of finished runs with each verdict, in the order of kVerdicts.
  std::array<std::int64_t, kVerdicts.size()> verdicts{};
  std::map<std::string, Spread> metrics;
  /// 95 % interval of the mean of each metric, see internal::MeanInterval().
  std::map<std::string, Interval> mean_intervals;
  std::map<std::string, std::string> units;  ///< units, as in EstimatorResult

  /// Returns the number of runs with this verdict.
  std::int64_t CountOf(VerdictState state) const {
    return verdicts[static_cast<std::size_t>(state)];
  }
};
/// Summarises each estimator over all runs.
std::vector<SweepSummary> Summarise(const SweepResult& result);

/// Formats the counts of verdicts and the statistics of the most relevant metrics for a terminal of
/// this width. table.md contains all metrics. `summaries` is the result of Summarise(result).
std::string SweepTable(const SweepResult& result, const std::vector<SweepSummary>& summaries,
                       std::size_t width = internal::kDefaultTextWidth);
/// Formats the means of the main metrics in a table for each estimator, with a row for each value.
/// A `*` marks the least error of each block, and the value of NEES or NIS that is nearest to 1.
std::string SweepTable(const VariedSweep& sweep, std::size_t width = internal::kDefaultTextWidth);

/// Output folder of a sweep (docs/cli.md). It contains sweep.json, runs.csv, table.md, report.html,
/// config.resolved.yaml, and failures.csv if a run failed. A varied sweep adds sweep.csv. A shard
/// adds finished_runs.jsonl, which MergeShards() reads. Until all runs are finished, the folder is
/// `FOLDER.partial`, and its finished_runs.jsonl contains the runs that are finished.
class SweepFolder {
 public:
  struct Options {
    std::filesystem::path folder;
    bool force = false;
    std::string inputs;   ///< text of inputs.json
    bool resume = false;  ///< true: continues the sweep in `FOLDER.partial` if it exists
    bool shard = false;   ///< true: the sweep is a shard
  };
  /// Creates the folder, or continues the sweep in it. Errors: those of OutputFolder; kCannotCreate
  /// if the sweep in the folder has another config or other inputs.
  SweepFolder(const Options& options, const Config& config);
  /// Creates a folder without inputs.json. The sweep cannot be resumed, because no run is recorded
  /// before Write().
  SweepFolder(const std::filesystem::path& folder, bool force);
  ~SweepFolder();
  SweepFolder(const SweepFolder&) = delete;
  SweepFolder& operator=(const SweepFolder&) = delete;

  /// Returns the record of finished runs for SweepOptions. Returns null if the folder does not
  /// contain inputs.json.
  internal::FinishedRuns* finished();
  /// Returns the output folder, to which the caller may add files.
  const internal::OutputFolder& files() const;
  /// Writes an additional file that contains `text`. Errors: kCannotCreate, kIo.
  void AddFile(const std::string& name, const std::string& text);
  /// Writes all files and renames the folder. A stopped sweep with inputs.json remains in
  /// `FOLDER.partial`. `summaries` is the result of Summarise(result). Errors: kCannotCreate, kIo.
  void Write(const SweepResult& result, const std::vector<SweepSummary>& summaries,
             const Config& config);
  /// Writes the folder of a varied sweep in the same way.
  void Write(const VariedSweep& sweep, const Config& config);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace alidade
