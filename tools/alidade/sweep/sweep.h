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

#include "alidade/base/statistics.h"
#include "alidade/experiment/run.h"
#include "alidade/sweep/named_values.h"

namespace alidade {

namespace internal {
class FinishedRuns;  // in alidade/sweep/finished_runs.h
class OutputFolder;  // in alidade/io/output_folder.h
}  // namespace internal

/// One of `count` shares of consecutive seeds. The sizes of two shares differ by at most one.
struct Shard {
  int index = 1;  ///< from 1 to count
  int count = 1;
};

struct SweepOptions {
  std::int64_t runs = 1;  ///< of all shards together, with consecutive seeds from first_seed
  std::uint64_t first_seed = 1;
  /// Number of threads; 0: one for each processor that the process may use. Only one thread is used
  /// if any loaded model lacks ALIDADE_THREAD_INSTANCES (several instances at once).
  int jobs = 0;
  std::optional<Shard> shard = {};  ///< the share to run; nullopt: all runs
  /// Function that executes a run, called by several threads at once; empty: alidade::Run.
  std::function<RunResult(Experiment&, const RunOptions&)> run;
  std::function<void(std::int64_t, std::int64_t)> progress;  ///< finished runs, total runs
  std::function<bool()> stop;                                ///< true: discard unfinished runs
  /// SweepFolder::finished(): recorded runs are not repeated, new ones are added. Null: every run
  /// is executed.
  internal::FinishedRuns* finished = nullptr;
  std::string value = {};  ///< value of the varied key, as recorded in `finished`
};

/// RMS of the innovations z - h of one landmark sensor, for each frame from the first.
struct FrameErrors {
  std::string estimator, sensor, unit;
  std::vector<double> rms;  ///< NaN for a frame without innovations
};

/// A row of runs.csv: the values of one EstimatorResult. Rows with equal names share them.
struct SweepRow {
  SweepRow() = default;
  explicit SweepRow(const EstimatorResult& result)
      : name(result.name),
        metrics(result.metrics),
        counts(result.counts),
        units(result.units),
        diverged(result.diverged),
        inconsistent(result.inconsistent),
        failed(result.failed) {}

  std::string name;
  NamedValues<double> metrics;
  NamedValues<std::int64_t> counts;
  NamedValues<std::string> units;
  bool diverged = false;
  bool inconsistent = false;
  bool failed = false;
};

/// One run of a sweep.
struct SweepRun {
  std::uint64_t seed = 0;
  RunStatus status = RunStatus::kOk;
  ExitCode code = ExitCode::kOk;
  std::string reason;
  std::vector<SweepRow> estimators;
  std::vector<FrameErrors> reprojection = {};  ///< first 500 frames; for a varied sweep only
  bool withheld = false;                       ///< there was no reference, as in RunResult

  /// Shares the lists of names among the estimators of all runs that use the same pool.
  void ShareNames(SharedNames& pool) {
    for (SweepRow& row : estimators) {
      row.metrics.ShareNames(pool);
      row.counts.ShareNames(pool);
      row.units.ShareNames(pool);
    }
  }
  /// Reports whether summaries use the metrics of `row`: the run finished and the estimator did not
  /// diverge.
  bool UsesMetricsOf(const SweepRow& row) const {
    return status == RunStatus::kOk && !row.diverged;
  }
};

struct SweepResult {
  std::int64_t runs = 0;  ///< requested runs of this shard
  std::uint64_t first_seed = 1;
  bool stopped = false;
  std::string reference = "truth";      ///< as in RunResult
  std::vector<std::string> estimators;  ///< in the order of the config
  std::vector<SweepRun> done;           ///< by seed, including failed runs
};

/// Runs `config` once for each seed (key `source.seed`), in memory. Each run is built from its own
/// copy of the config. Results do not depend on the number of threads. A run in which an estimator
/// diverges continues, even with `on_divergence: fail`. A failure ends only the run in which it
/// occurs. Errors: those of BuildExperiment, before the first run; kIo if a finished run cannot be
/// written.
SweepResult Sweep(const Config& config, const PluginHost& host, const SweepOptions& options);

/// Varied keys of the config and their values. All keys are set to the same value at a time.
struct Variation {
  std::string key;                  ///< dotted, as for Config::Set; several are joined as `KEY+KEY`
  std::vector<std::string> values;  ///< each read as YAML

  /// Parses `KEY=v1,v2,v3` or `KEY+KEY=v1,v2,v3`. Commas inside brackets, braces and quotes belong
  /// to their value. Error: kUsage if a key or a value is missing or repeated, or a bracket is not
  /// closed.
  static Variation FromText(const std::string& text);
  /// Returns each key.
  std::vector<std::string> Keys() const;
  /// Sets all keys to the value. Errors: those of Config::Set.
  void Set(Config& config, const std::string& value) const;
};

/// One sweep for each value, with the same seeds.
struct VariedSweep {
  Variation variation;
  std::vector<SweepResult> results;  ///< by value; fewer if the sweep was stopped

  bool stopped() const { return !results.empty() && results.back().stopped; }
};

/// Executes a sweep of `config` for each value of the variation. `options.progress` counts the runs
/// of all values. Errors, before the first run: kBadConfig if the key is `source.seed`, if its
/// parent map does not exist, or if the values lead to different estimators; those of
/// BuildExperiment for each value.
VariedSweep SweepVariation(const Config& config, const PluginHost& host,
                           const SweepOptions& options, const Variation& variation);

/// Metrics of one estimator over all runs.
struct SweepSummary {
  std::string name;
  std::int64_t used = 0;          ///< number of runs that the metrics use
  std::int64_t diverged = 0;      ///< number of runs in which it diverged; not used
  std::int64_t inconsistent = 0;  ///< number of used runs with inconsistent errors
  std::map<std::string, Spread> metrics;
  std::map<std::string, std::string> units;  ///< as in EstimatorResult
};
/// Summarises each estimator over all runs.
std::vector<SweepSummary> Summarise(const SweepResult& result);

/// Formats mean [p05, p50, p95] of the main metrics for a terminal, one column for each estimator.
/// `summaries` is the result of Summarise(result).
std::string SweepTable(const SweepResult& result, const std::vector<SweepSummary>& summaries);
/// Formats one table of mean main metrics for each estimator, one row for each value.
std::string SweepTable(const VariedSweep& sweep);

/// Output folder of a sweep (docs/cli.md). It contains sweep.json, runs.csv, table.md,
/// config.resolved.yaml, and failures.csv if a run failed. A varied sweep adds sweep.csv and a
/// figure. A shard adds finished_runs.jsonl, which MergeShards() reads. Until all runs are finished
/// the folder is `FOLDER.partial`, whose finished_runs.jsonl contains the finished runs.
class SweepFolder {
 public:
  struct Options {
    std::filesystem::path folder;
    bool force = false;
    std::string inputs;   ///< the text of inputs.json
    bool resume = false;  ///< continue the sweep in `FOLDER.partial`, if that exists
    bool shard = false;   ///< the sweep is a shard
  };
  /// Creates or continues the folder. Errors: those of OutputFolder; kCannotCreate if the sweep to
  /// be resumed has another config or other inputs.
  SweepFolder(const Options& options, const Config& config);
  /// Creates a folder without inputs.json. It cannot be resumed: no run is recorded before Write().
  SweepFolder(const std::filesystem::path& folder, bool force);
  ~SweepFolder();
  SweepFolder(const SweepFolder&) = delete;
  SweepFolder& operator=(const SweepFolder&) = delete;

  /// Returns the record of finished runs for SweepOptions; null if the folder has no inputs.json.
  internal::FinishedRuns* finished();
  /// Returns the folder, for additional files.
  const internal::OutputFolder& files() const;
  /// Writes an additional file with that text. Errors: kCannotCreate, kIo.
  void AddFile(const std::string& name, const std::string& text);
  /// Writes all files and renames the folder. A stopped sweep with inputs.json remains in
  /// `FOLDER.partial`. `summaries` is the result of Summarise(result). Errors: kCannotCreate, kIo.
  void Write(const SweepResult& result, const std::vector<SweepSummary>& summaries,
             const Config& config);
  /// Writes the folder of a varied sweep in the same way. Returns the reason if a figure is
  /// missing, else "". `stop` ends the drawing. Errors: kCannotCreate, kIo.
  std::string Write(const VariedSweep& sweep, const Config& config,
                    const std::function<bool()>& stop = {});

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace alidade
