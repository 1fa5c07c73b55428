// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "alidade/compare/over_seeds.h"
#include "alidade/experiment/run.h"
#include "alidade/sweep/sweep.h"

/// Comparison of estimators over the same data, and decomposition of their differences
/// (docs/compare.md). A filter, which uses past data only, is never compared with a smoother, which
/// uses all data: the reference of each estimator is a batch of the same data.
namespace alidade {

/// Options of a comparison.
struct CompareOptions {
  /// Reference of the errors: `truth`, or the name of an estimator. "": truth if it is known, else
  /// the batch.
  std::string reference;
  std::string filter;  ///< the filter whose error is decomposed; "": the first one
  /// Compute the error decomposition, and add the estimators that it needs to a config.
  bool decompose = true;
  /// The comparison is over several seeds, each of which reads the source.
  bool over_seeds = false;
  /// Time budget, s. Over seeds, no run except the first is started if it would end after the
  /// budget (wall clock). For a single run, an estimator is not added if its CPU time, predicted
  /// from the first frames, would exceed the budget together with the others.
  std::optional<double> budget_s = {};
};

/// One estimator of a comparison. Its values are the metrics of run.json by their keys, if these
/// are relative to truth, and
///
///   rmsd:BLOCK                     sqrt(mean |d|^2), d = x (-) x_ref      unit of the block
///   final_difference:BLOCK         |d| at the last timestamp
///   rmsd.sigmas:OWNER              sqrt(mean d' P_ref^-1 d / dof), in sigmas of the reference
///   final_difference.sigmas:OWNER  the same at the last timestamp
///   trajectory.sim3.rmsd           RMSD of the trajectory after alignment by a similarity, m
///   map.rmsd                       RMSD of the landmark positions at the end, m
///   map.sim3.rmsd                  the same after alignment of the map by a similarity, m
///   time_us                        wall-clock time for each measurement
///   cpu_us                         CPU time for each frame; for a batch, without cpu_us.start
///   cpu_us.start                   CPU time of the filter from which a batch starts
struct ComparedEstimator {
  std::string name, type;
  bool smoothed = false;        ///< true if its estimates also use later data
  std::string reference;        ///< reference of its estimates over the run; "": no reference
  std::string final_reference;  ///< reference of the last estimate and of the map
  /// Number of used runs in which the reference exists.
  std::int64_t reference_runs = 0, final_reference_runs = 0;
  std::map<std::string, Spread> values;
  /// Ratios to the reference by KEY: of rmse, final_error and map. Over seeds also
  /// `mse_by_bound:BLOCK` of an online estimator, the mean of |e|^2 / tr P, P the Cramer-Rao bound.
  std::map<std::string, Ratio> ratios;
  std::map<std::string, std::string> units;  ///< of blocks
  std::int64_t used = 0;                     ///< number of runs that the values use
  std::int64_t diverged = 0;                 ///< number of runs in which it diverged
  ErrorSeries series;                        ///< errors of one run of several seeds
  OverTime over_time;                        ///< averages over several runs
  /// Interval that contains the mean error over several runs with probability 0.95, by KEY.
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

/// One step from the filter to the batch. Values: `rmsd:BLOCK` and `rmsd.sigmas:OWNER` between the
/// two estimators; `rmse.from:BLOCK` and `rmse.to:BLOCK`, the RMSE of `estimator` and `reference`
/// relative to truth; `measurements` and `rejected`, only for kRejected. If `at_end` is true, the
/// values are those of the last frame, and BLOCK may also be `map` or `map.sim3`.
struct DecompositionStep {
  DecompositionKind kind = DecompositionKind::kLinearisation;
  std::string estimator, reference;  ///< names of the two estimators
  bool at_end = false;  ///< at the last frame, because there is no full-information filter
  std::map<std::string, Spread> values;
  std::map<std::string, Ratio> ratios;  ///< by `rmse:BLOCK`, of `estimator` relative to `reference`
  std::string withheld;                 ///< why there are no values, or ""
};

/// Comparison of estimators over one run or several runs.
struct Comparison {
  std::int64_t runs = 1;  ///< number of seeds, over which the values are spread
  std::int64_t frames = 0;
  RunStatus status = RunStatus::kOk;  ///< worst status of the runs; over seeds kOk or kStopped
  std::string reference;              ///< `truth`, or the first estimator that is a reference
  std::string withheld;               ///< reason for a missing reference or comparison, or ""
  std::string measurements_sha256;    ///< of the data; "": several seeds
  std::vector<ComparedEstimator> estimators;
  std::string decomposed;  ///< the filter whose error is decomposed
  std::vector<DecompositionStep> decomposition;
  std::vector<std::string> notes;  ///< notes for the reader, one line each
};

/// An experiment with the additional estimators for the error decomposition of a filter.
struct ComparedExperiment {
  Config config;  ///< including the added estimators
  Experiment experiment;
  std::string filter;              ///< filter whose error is decomposed; "": no filter
  std::vector<std::string> added;  ///< names of the added estimators
  std::vector<std::string> notes;  ///< added estimators, and missing ones with the reason
  /// Note for steps that lack an estimator because of the budget; "": the budget excludes none.
  std::string beyond_budget = {};
};

/// Builds the experiment of a config and adds the estimators that its comparison lacks: the batch
/// of all data, the full-information filter, the batch of the accepted measurements, and the
/// smoother, each with the sensors, overrides and steps of the filter. An estimator that does not
/// support the problem is not added, nor, for a single run, one that exceeds the budget. Errors:
/// those of BuildExperiment; kUsage if `options` names an estimator that does not exist, or if
/// its filter is not an online filter.
ComparedExperiment BuildComparedExperiment(const Config& config, const PluginHost& host,
                                           const CompareOptions& options);

/// Observer that compares the estimators of a run.
class RunComparer : public RunObserver {
 public:
  /// Adds a CPU clock to each estimator of the experiment. `over_seeds`: the run is one of several
  /// seeds, and its errors are recorded at each timestamp.
  explicit RunComparer(Experiment& experiment, bool over_seeds = false);
  ~RunComparer() override;
  RunComparer(const RunComparer&) = delete;
  RunComparer& operator=(const RunComparer&) = delete;

  void OnFrame(const SourceFrame& frame) override;
  void OnEstimate(int estimator, const SourceFrame& frame, const State& state,
                  const UpdateReport& report) override;
  /// Returns the comparison. Called once, after the run. Errors: kUsage if `options` names an
  /// estimator that does not exist.
  Comparison Finish(const RunResult& result, const CompareOptions& options);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Compares the estimators of finished runs, read from their folders. With several folders the
/// names are `FOLDER/NAME`. Errors: kUsage if a folder is given twice; kInputMissing; kBadData if
/// the runs have different measurements; those of RunComparer.
Comparison CompareFolders(const std::vector<std::filesystem::path>& folders,
                          const CompareOptions& options);

/// A comparison over seeds with its sweep.
struct ComparedSeeds {
  Comparison comparison;
  SweepResult sweep;
  std::int64_t beyond_budget = 0;  ///< number of runs that the budget excludes
};
/// Runs and compares a config once for each seed. The values of an estimator exclude the runs in
/// which it diverged. Errors: those of Sweep and of RunComparer.
ComparedSeeds CompareSeeds(const ComparedExperiment& compared, const PluginHost& host,
                           const SweepOptions& sweep, const CompareOptions& options);

/// Summarises comparisons of the same estimators, at least one: mean and quantiles of each value,
/// and the statistics over all runs.
Comparison Summarise(const std::vector<Comparison>& comparisons);

/// Writes report.html of a comparison over several seeds, the figures of errors, average NEES and
/// cost, and their csv files (docs/compare.md). Returns the reason if figures are missing, else "".
/// `stop` ends the drawing. Errors: kCannotCreate, kIo.
std::string WriteSeedReport(const internal::OutputFolder& folder, const Comparison& comparison,
                            const Config& config, const std::function<bool()>& stop);

/// Format of a report.
enum class TableStyle { kText, kMarkdown, kLatex, kHtml };
/// Rows of the tables: all rows, or the main ones with the number of omitted rows. The main rows
/// are errors, their ratios, NEES and the wall clock; without truth, differences instead of errors.
enum class ReportRows { kAll, kMain };
/// Formats the tables and the error decomposition.
std::string CompareReport(const Comparison& comparison, TableStyle style,
                          ReportRows rows = ReportRows::kAll);
/// Formats all values as JSON (docs/compare.md).
std::string CompareJson(const Comparison& comparison);

/// Writes compare.json, compare.md and compare.tex into a new folder. Errors: kCannotCreate if the
/// folder exists and `force` is false, kIo.
void WriteComparison(const Comparison& comparison, const std::filesystem::path& folder, bool force);

}  // namespace alidade
