// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "alidade/compare/over_seeds.h"
#include "alidade/diagnosis/verdict.h"
#include "alidade/experiment/run.h"
#include "alidade/sweep/sweep.h"

/// Comparison of estimators over the same data, and decomposition of the differences between them
/// (docs/compare.md). The reference of each estimator is a batch of the same data. A filter uses
/// past data only, so over the run it is not compared with a smoother of all data.
namespace alidade {

/// Condition under which a comparison adds the full-information filter, which solves a batch at
/// every frame.
enum class FullInformation {
  /// Unless it would take 10 s or more of CPU time, and more than half of the whole. If the time
  /// cannot be predicted: unless the system has landmarks.
  kIfFast,
  kAlways,
  kNever,
};

/// Options of a comparison.
struct CompareOptions {
  /// Reference of the errors: `truth`, or the name of an estimator. If this option is empty, the
  /// reference is truth if truth is known, otherwise the batch.
  std::string reference;
  std::string filter;  ///< name of the filter whose error is decomposed; "": the first filter
  /// True: the error decomposition is computed, and missing estimators are added to the config.
  bool decompose = true;
  /// True: the comparison is over several seeds, and the source is read once for each seed.
  bool over_seeds = false;
  std::int64_t runs = 1;  ///< number of runs of the comparison
  /// Time budget, s. Over seeds, the budget limits the wall-clock time. A run other than the first
  /// is not started if it would probably exceed the budget. For a single run, the budget limits the
  /// CPU time, which is predicted for each estimator from the first frames. An estimator is not
  /// added if the sum of the predicted times would exceed the budget.
  std::optional<double> budget_s = {};
  /// If a single run has a budget, the budget replaces the condition kIfFast.
  FullInformation full_information = FullInformation::kIfFast;
};

/// One estimator of a comparison. The values include the metrics of run.json. Metrics that need
/// truth are included only if the errors are relative to truth. The other values are:
///
///   rmsd:BLOCK                     sqrt(mean |d|^2), d = x (-) x_ref      unit of the block
///   final_difference:BLOCK         |d| at the last timestamp
///   rmsd.sigmas:OWNER              sqrt(mean d' P_ref^-1 d / dof), in sigmas of the reference
///   final_difference.sigmas:OWNER  sqrt(d' P_ref^-1 d / dof) at the last timestamp
///   trajectory.sim3.rmsd           RMSD of the trajectory after alignment by a similarity, m
///   map.rmsd                       RMSD of the landmark positions at the end, m
///   map.sim3.rmsd                  map.rmsd after alignment of the map by a similarity, m
///   time_us                        wall-clock time for each measurement, us
///   cpu_us                         CPU time for each frame, us; excludes cpu_us.start
///   cpu_us.start                   CPU time for each frame of the filter from which a batch
///                                  starts, us
struct ComparedEstimator {
  std::string name, type;
  bool smoothed = false;        ///< true: the estimates also use later data
  std::string reference;        ///< reference of the estimates over the run; "": no reference
  std::string final_reference;  ///< reference of the last estimate and of the map
  /// Number of used runs in which the reference exists.
  std::int64_t reference_runs = 0, final_reference_runs = 0;
  std::map<std::string, Spread> values;
  /// Ratio of each rmse, final_error and map error to the same error of the reference, by key. For
  /// an online estimator over seeds, the map also contains `mse_by_bound:BLOCK`, the mean of |e|^2
  /// / tr P, with the Cramer-Rao bound P.
  std::map<std::string, Ratio> ratios;
  std::map<std::string, std::string> units;  ///< units of blocks
  std::int64_t used = 0;                     ///< number of runs from which the values are computed
  std::int64_t diverged = 0;                 ///< number of runs in which the estimator diverged
  /// Number of runs with each verdict, in the order of kVerdicts.
  std::array<std::int64_t, kVerdicts.size()> verdicts{};
  ErrorSeries series;  ///< errors, if the run is one of several seeds
  OverTime over_time;  ///< averages over several runs
  /// Intervals of the mean errors over several runs, by key. An interval contains the mean with
  /// probability 0.95.
  std::map<std::string, Interval> mean_intervals = {};
};

/// Cause of a part of the difference between a filter and the batch of all data.
enum class DecompositionKind {
  kLinearisation,  ///< filter compared with the full-information filter of the accepted data
  kSmoothing,      ///< filter compared with a smoother of the same models: gain from later data
  kRejected,       ///< batch of the accepted data compared with the batch of all data
};
/// Returns `linearisation`, `smoothing` or `rejected_measurements`.
const char* ToString(DecompositionKind kind);

/// One step from the filter to the batch. `rmsd:BLOCK` and `rmsd.sigmas:OWNER` are differences
/// between the two estimators. `rmse.from:BLOCK` and `rmse.to:BLOCK` are the RMSE of `estimator`
/// and `reference` relative to truth. Only kRejected has the values `measurements` and `rejected`.
/// If `at_end` is true, the values are those of the last frame, and BLOCK may also be `map` or
/// `map.sim3`.
struct DecompositionStep {
  DecompositionKind kind = DecompositionKind::kLinearisation;
  std::string estimator, reference;  ///< names of the two estimators
  bool at_end = false;               ///< true: the values are those of the last frame
  std::map<std::string, Spread> values;
  /// `rmse:BLOCK` of `estimator` / `rmse:BLOCK` of `reference`.
  std::map<std::string, Ratio> ratios;
  std::string withheld;  ///< reason why there are no values, or ""
};

/// Comparison of estimators over one run or several runs.
struct Comparison {
  std::int64_t runs = 1;  ///< number of seeds
  std::int64_t frames = 0;
  RunStatus status = RunStatus::kOk;  ///< worst status of the runs; over seeds, kOk or kStopped
  std::string reference;              ///< `truth`, or the name of the first reference estimator
  std::string withheld;               ///< reason for a missing reference or comparison, or ""
  std::string measurements_sha256;    ///< hash of the data; "" for several seeds
  std::vector<ComparedEstimator> estimators;
  std::string decomposed;  ///< name of the filter whose error is decomposed
  std::vector<DecompositionStep> decomposition;
  std::vector<std::string> notes;  ///< notes for the reader, each a single line
};

/// Experiment to which the estimators for the error decomposition of a filter have been added.
struct ComparedExperiment {
  Config config;  ///< config with the added estimators
  Experiment experiment;
  std::string filter;              ///< name of the filter whose error is decomposed, or ""
  std::vector<std::string> added;  ///< names of the added estimators
  std::vector<std::string> notes;  ///< notes on the added and the omitted estimators
  /// Note for steps that lack an estimator because of the budget. It is empty if the budget does
  /// not exclude an estimator.
  std::string beyond_budget = {};
  /// Note on the full-information filter if it is omitted because of its predicted CPU time, or "".
  std::string too_slow = {};
};

/// Builds the experiment of a config and adds the estimators that the comparison needs: the batch
/// of all data, the full-information filter, the batch of the accepted measurements, and the
/// smoother. Each added estimator has the sensors, overrides and steps of the filter. An estimator
/// is omitted if it does not support the problem, if it would exceed the budget of a single run, or
/// because of CompareOptions::full_information.
/// Errors: those of BuildExperiment(); kUsage if an estimator in `options` does not exist, or if
/// `options.filter` is not an online filter.
ComparedExperiment BuildComparedExperiment(const Config& config, const PluginHost& host,
                                           const CompareOptions& options);

/// Observer that compares the estimators of a run.
class RunComparer : public RunObserver {
 public:
  /// Adds a CPU clock to each estimator of the experiment. If `over_seeds` is true, the run is one
  /// of several seeds, and the errors at each timestamp are recorded.
  explicit RunComparer(Experiment& experiment, bool over_seeds = false);
  ~RunComparer() override;
  RunComparer(const RunComparer&) = delete;
  RunComparer& operator=(const RunComparer&) = delete;

  void OnFrame(const SourceFrame& frame) override;
  void OnEstimate(int estimator, const SourceFrame& frame, const State& state,
                  const UpdateReport& report) override;
  /// Returns the comparison. Call this function once, after the run. Error: kUsage if an estimator
  /// in `options` does not exist.
  Comparison Finish(const RunResult& result, const CompareOptions& options);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Compares the estimators of finished runs, which are read from their folders. If there are
/// several folders, the names are `FOLDER/NAME`. Errors: kUsage if a folder is given twice;
/// kInputMissing; kBadData if the runs have different measurements; those of RunComparer.
Comparison CompareFolders(const std::vector<std::filesystem::path>& folders,
                          const CompareOptions& options);

/// Comparison over several seeds, and the sweep that ran the seeds.
struct ComparedSeeds {
  Comparison comparison;
  SweepResult sweep;
  std::int64_t beyond_budget = 0;  ///< number of runs that the budget excludes
};
/// Runs a config once for each seed, and compares the estimators. The values of an estimator
/// exclude the runs in which this estimator diverged. Errors: those of Sweep and of RunComparer.
ComparedSeeds CompareSeeds(const ComparedExperiment& compared, const PluginHost& host,
                           const SweepOptions& sweep, const CompareOptions& options);

/// Summarises at least one comparison of the same estimators. Computes the mean and the quantiles
/// of each value, and the statistics over all runs.
Comparison Summarise(const std::vector<Comparison>& comparisons);

/// Writes over_time.csv and cost.csv of a comparison over several seeds (docs/compare.md). Errors:
/// kCannotCreate, kIo.
void WriteSeedFiles(const internal::OutputFolder& folder, const Comparison& comparison);

/// Format of a report.
enum class TableStyle { kText, kMarkdown, kLatex };
/// Rows of the tables: all rows, or the main rows and the number of omitted rows. The main rows are
/// errors, ratios of errors, NEES and the wall-clock time. Without truth, differences replace
/// errors.
enum class ReportRows { kAll, kMain };
/// Formats the tables and the error decomposition. `width` is the width of lines for kText.
std::string CompareReport(const Comparison& comparison, TableStyle style,
                          ReportRows rows = ReportRows::kAll,
                          std::size_t width = internal::kDefaultTextWidth);
/// Formats all values as JSON (docs/compare.md).
std::string CompareJson(const Comparison& comparison);

/// Writes compare.json, compare.md and compare.tex into a new folder. Errors: kCannotCreate if the
/// folder exists and `force` is false, kIo.
void WriteComparison(const Comparison& comparison, const std::filesystem::path& folder, bool force);

}  // namespace alidade
