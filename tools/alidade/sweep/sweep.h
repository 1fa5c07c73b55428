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

/// One of so many equal shares of the seeds, in order; counted from 1.
struct Shard {
  int index = 1, of = 1;
};

struct SweepOptions {
  std::int64_t runs = 1;  ///< of all shards together; their seeds count up from first_seed
  std::uint64_t first_seed = 1;
  /// Threads; 0: one for each processor that the process may use. One where a model on offer does
  /// not allow several instances at once (no ALIDADE_THREAD_INSTANCES).
  int jobs = 0;
  std::optional<Shard> shard = {};  ///< the share that is run; none: all
  /// What makes a run, from several threads at once; empty: alidade::Run.
  std::function<RunResult(Experiment&, const RunOptions&)> run;
  std::function<void(std::int64_t, std::int64_t)> progress;  ///< runs done, runs in all
  std::function<bool()> stop;                                ///< true: drop unfinished runs
  /// SweepFolder::finished(): runs that are in it are not made again, the others are added to it.
  /// Null: all are made.
  internal::FinishedRuns* finished = nullptr;
  std::string value = {};  ///< of the varied key, in `finished`
};

/// The rms of the innovations z - h of one sensor of landmarks, frame by frame, from the first on.
struct FrameErrors {
  std::string estimator, sensor, unit;
  std::vector<double> rms;  ///< not a number where a frame has none
};

/// A row of runs.csv: the numbers of one EstimatorResult, the names shared with the other rows.
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
  std::vector<FrameErrors> reprojection = {};  ///< of a varied sweep, the first 500 frames
  bool withheld = false;                       ///< no reference to compare with, as in RunResult

  /// Lets its estimators have one list of names with all that have the same, of other runs too.
  void ShareNames(SharedNames& with) {
    for (SweepRow& one : estimators) {
      one.metrics.ShareNames(with);
      one.counts.ShareNames(with);
      one.units.ShareNames(with);
    }
  }
  /// Whether the metrics of `one` count: the run is whole, and it did not diverge.
  bool Uses(const SweepRow& one) const { return status == RunStatus::kOk && !one.diverged; }
};

struct SweepResult {
  std::int64_t runs = 0;  ///< asked for, of this shard
  std::uint64_t first_seed = 1;
  bool stopped = false;
  std::string reference = "truth";      ///< as in RunResult
  std::vector<std::string> estimators;  ///< in the order of the config
  std::vector<SweepRun> done;           ///< by seed, those that failed too
};

/// Runs `config` once for each seed (key `source.seed`), in memory, each run built afresh from its
/// own copy of the config. Results do not depend on the number of threads. A run in which an
/// estimator diverges goes on also under `on_divergence: fail`. What ends one run, ends that one
/// only. Errors: those of BuildExperiment, before the first run; kIo if a finished run cannot be
/// written.
SweepResult Sweep(const Config& config, const PluginHost& host, const SweepOptions& options);

/// Keys of the config, and the values that all of them take one after the other.
struct Variation {
  std::string key;                  ///< dotted, as Config::Set takes it; of several `KEY+KEY`
  std::vector<std::string> values;  ///< each read as YAML

  /// Reads `KEY=v1,v2,v3` or `KEY+KEY=v1,v2,v3`; commas inside brackets, braces and quotes belong
  /// to their value. Error: kUsage where a key or a value is missing or comes twice, or a bracket
  /// is left open.
  static Variation FromText(const std::string& text);
  /// Each key.
  std::vector<std::string> Keys() const;
  /// Gives all keys the value. Errors: those of Config::Set.
  void Set(Config& config, const std::string& value) const;
};

/// One sweep for each value, with the same seeds.
struct VariedSweep {
  Variation variation;
  std::vector<SweepResult> results;  ///< by value; fewer where it was stopped

  bool stopped() const { return !results.empty() && results.back().stopped; }
};

/// Sweeps over `config` with each value of the variation in turn; `options.progress` counts the
/// runs of all. Errors, before the first run: kBadConfig where the key is `source.seed`, the map
/// that it is in is not there, or the values have different estimators; those of BuildExperiment
/// for any of the values.
VariedSweep SweepOver(const Config& config, const PluginHost& host, const SweepOptions& options,
                      const Variation& variation);

/// One estimator over all runs.
struct SweepSummary {
  std::string name;
  std::int64_t used = 0;          ///< runs that metrics are taken over
  std::int64_t diverged = 0;      ///< runs left out because it diverged
  std::int64_t inconsistent = 0;  ///< those of `used` in which its error was
  std::map<std::string, Spread> metrics;
  std::map<std::string, std::string> units;  ///< as in EstimatorResult
};
std::vector<SweepSummary> Summarise(const SweepResult& result);

/// Mean [p05, p50, p95] of the main metrics, one column for each estimator, for a terminal;
/// `summaries` are those of Summarise(result).
std::string SweepTable(const SweepResult& result, const std::vector<SweepSummary>& summaries);
/// For each estimator a table with a row for each value: means of the main metrics.
std::string SweepTable(const VariedSweep& sweep);

/// The folder of a sweep (docs/cli.md): sweep.json, runs.csv, table.md, config.resolved.yaml, and
/// failures.csv if a run failed; of a varied one sweep.csv and a figure too; of a shard
/// finished_runs.jsonl, which MergeShards() reads. Until all runs are finished it is
/// `FOLDER.partial`, whose finished_runs.jsonl has those that are.
class SweepFolder {
 public:
  struct Options {
    std::filesystem::path folder;
    bool force = false;
    std::string inputs;   ///< the text of inputs.json
    bool resume = false;  ///< continue the sweep that left `FOLDER.partial`, if that exists
    bool shard = false;   ///< the sweep is a shard
  };
  /// Errors: those of OutputFolder; kCannotCreate if the sweep to be resumed was made from another
  /// config or other inputs.
  SweepFolder(const Options& options, const Config& config);
  /// Likewise, without inputs: nothing is kept before Write().
  SweepFolder(const std::filesystem::path& folder, bool force);
  ~SweepFolder();
  SweepFolder(const SweepFolder&) = delete;
  SweepFolder& operator=(const SweepFolder&) = delete;

  /// For SweepOptions; null: there is no inputs.json.
  internal::FinishedRuns* finished();
  /// For files that it has besides.
  const internal::OutputFolder& files() const;
  /// Puts a file of that text into the folder too. Errors: kCannotCreate, kIo.
  void AddFile(const std::string& name, const std::string& text);
  /// Writes all files and renames the folder; but with inputs, a sweep that was stopped stays in
  /// `FOLDER.partial`. `summaries` are those of Summarise(result). Errors: kCannotCreate, kIo.
  void Write(const SweepResult& result, const std::vector<SweepSummary>& summaries,
             const Config& config);
  /// Likewise. Returns why there is no figure, or "". `stop` ends the drawing. Errors:
  /// kCannotCreate, kIo.
  std::string Write(const VariedSweep& sweep, const Config& config,
                    const std::function<bool()>& stop = {});

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace alidade
