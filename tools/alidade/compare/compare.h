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

/// Estimators over the same data, compared, and where their difference comes from
/// (docs/compare.md). What a filter makes of the past is never compared with what a smoother makes
/// of all data: each is compared with the batch of the data that it had.
namespace alidade {

struct CompareOptions {
  /// What errors are taken from: `truth`, or an estimator. "": truth where it is known, else the
  /// batch.
  std::string reference;
  std::string filter;     ///< the one whose error is decomposed; "": the first
  bool decompose = true;  ///< else no error decomposition, and nothing is added to a config for it
  bool over_seeds = false;  ///< the source is read for each of several seeds
  /// What a comparison may take, s. Over seeds no run is begun that would end later by the wall
  /// clock; but for the first. Of one run nothing is added whose CPU time, foretold from its first
  /// frames, would be too much with that of the others.
  std::optional<double> budget_s = {};
};

/// One estimator of a comparison. Values are those of run.json by their keys, where these are
/// errors from truth, and
///
///   rmsd:BLOCK                     sqrt(mean |d|^2), d = x (-) x_ref      unit of the block
///   final_difference:BLOCK         |d| at the last timestamp
///   rmsd.sigmas:OWNER              sqrt(mean d' P_ref^-1 d / dof), in sigmas of the reference
///   final_difference.sigmas:OWNER  the same at the last timestamp
///   trajectory.sim3.rmsd           RMSD of the trajectory after the similarity that fits best, m
///   map.rmsd                       rms of the places of landmarks at the end, m
///   map.sim3.rmsd                  likewise after that similarity of the map, m
///   time_us                        wall clock for each measurement
///   cpu_us                         CPU time for each frame, of a batch without
///   cpu_us.start                   that of the filter that it starts from; as it is run alone
struct ComparedEstimator {
  std::string name, type;
  bool smoothed = false;        ///< its estimates rest on later data too
  std::string reference;        ///< of its estimates along the run; "": there is none
  std::string final_reference;  ///< of the last estimate and the map
  std::int64_t reference_runs = 0, final_reference_runs = 0;  ///< of `used`, those with one
  std::map<std::string, Spread> values;
  /// By KEY, to the reference: of rmse, final_error, map; and over seeds `mse_by_bound:BLOCK`, mean
  /// |e|^2 / tr P, P the Cramer-Rao bound, of those that know the past alone.
  std::map<std::string, Ratio> ratios;
  std::map<std::string, std::string> units;  ///< of blocks
  std::int64_t used = 0;                     ///< runs that values are taken over
  std::int64_t diverged = 0;                 ///< runs in which it did
  ErrorSeries series;                        ///< of one run of several
  OverTime over_time;                        ///< of several runs
  /// Where the mean over several runs lies with probability 0.95, by KEY: of errors.
  std::map<std::string, Interval> mean_intervals = {};
};

/// Where a part of the difference between a filter and the batch of all data comes from.
enum class DecompositionKind {
  kLinearisation,  ///< the filter, compared with the full-information filter over what it accepted
  kSmoothing,      ///< the filter against a smoother of the same models: what later data add
  kRejected,       ///< the batch of what the filter accepted against the batch of all data
};
/// `linearisation`, `smoothing`, `rejected measurements`.
const char* ToString(DecompositionKind kind);

/// One step of the way from the filter to the batch. Values: `rmsd:BLOCK` and `rmsd.sigmas:OWNER`
/// between the two; `rmse.from:BLOCK`, `rmse.to:BLOCK`, the RMSE from truth; `measurements` and
/// `rejected` of kRejected. At the end they are of the last frame alone, and of BLOCK `map` and
/// `map.sim3` too.
struct DecompositionStep {
  DecompositionKind kind = DecompositionKind::kLinearisation;
  std::string from, to;
  bool at_end = false;  ///< taken at the last frame, for want of a full-information filter
  std::map<std::string, Spread> values;
  std::map<std::string, Ratio> ratios;  ///< by `rmse:BLOCK`, of `from` to `to`
  std::string withheld;                 ///< why there are no values, or ""
};

struct Comparison {
  std::int64_t runs = 1;  ///< seeds; values are spread over them
  std::int64_t frames = 0;
  RunStatus status = RunStatus::kOk;  ///< the worst of the runs'; of seeds kOk or kStopped
  std::string reference;              ///< `truth`, or the first estimator that one is compared with
  std::string withheld;               ///< why there is no reference, or nothing to compare; or ""
  std::string measurements_sha256;    ///< of the data; "": of several seeds
  std::vector<ComparedEstimator> estimators;
  std::string decomposed;  ///< the filter whose error it is
  std::vector<DecompositionStep> decomposition;
  std::vector<std::string> notes;  ///< what a reader has to know, a line each
};

/// An experiment with the estimators that decompose the error of a filter.
struct ComparedExperiment {
  Config config;  ///< with those that were added
  Experiment experiment;
  std::string filter;              ///< whose error it is; "": there is no filter
  std::vector<std::string> added;  ///< names
  std::vector<std::string> notes;  ///< what was added and what could not be, with the reason
  std::string beyond_budget = {};  ///< of steps of the decomposition that lack it; "": nothing was
};

/// Builds the experiment of a config, and adds what its comparison lacks: the batch of all data, of
/// the data up to each frame, of what the filter accepted, and the smoother, each with the filter's
/// sensors, overrides and steps. What does not support the problem is left out, and of one run what
/// the budget does not allow for. Errors: those of BuildExperiment; kUsage where `options` names an
/// estimator that is not there, or one that is no filter as that whose error is decomposed.
ComparedExperiment BuildComparedExperiment(const Config& config, const PluginHost& host,
                                           const CompareOptions& options);

/// Compares the estimators of a run while it runs.
class RunComparer : public RunObserver {
 public:
  /// Puts a clock on each estimator of the experiment. `over_seeds`: the run is one of several,
  /// whose errors are wanted timestamp by timestamp.
  explicit RunComparer(Experiment& experiment, bool over_seeds = false);
  ~RunComparer() override;
  RunComparer(const RunComparer&) = delete;
  RunComparer& operator=(const RunComparer&) = delete;

  void OnFrame(const SourceFrame& frame) override;
  void OnEstimate(int estimator, const SourceFrame& frame, const State& state,
                  const UpdateReport& report) override;
  /// Once, after the run. Errors: kUsage where `options` names an estimator that is not there.
  Comparison Finish(const RunResult& result, const CompareOptions& options);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Compares the estimators of finished runs, by their folders; names are `FOLDER/NAME` where there
/// are several. Errors: kUsage where a folder is given twice, kInputMissing, kBadData where they
/// did not see the same measurements, those of RunComparer.
Comparison CompareFolders(const std::vector<std::filesystem::path>& folders,
                          const CompareOptions& options);

/// A comparison over seeds, and the sweep that it is of.
struct ComparedSeeds {
  Comparison comparison;
  SweepResult sweep;
  std::int64_t beyond_budget = 0;  ///< runs that were not begun for want of time
};
/// Runs and compares a config once for each seed; the runs in which an estimator diverged count for
/// none of its values. Errors: those of Sweep and of RunComparer.
ComparedSeeds CompareSeeds(const ComparedExperiment& compared, const PluginHost& host,
                           const SweepOptions& sweep, const CompareOptions& options);

/// The values of comparisons of the same estimators, at least one, as mean and quantiles over them,
/// and what they tell together.
Comparison Summarise(const std::vector<Comparison>& comparisons);

/// What the folder of a comparison over several seeds shows besides its tables: report.html, the
/// figures of errors, average NEES and cost over the seeds, and the csv files that they are drawn
/// from (docs/compare.md). Returns why figures are missing, or "". `stop` ends the drawing. Errors:
/// kCannotCreate, kIo.
std::string WriteSeedReport(const internal::OutputFolder& folder, const Comparison& comparison,
                            const Config& config, const std::function<bool()>& stop);

/// How a comparison is written for people.
enum class TableStyle { kText, kMarkdown, kLatex, kHtml };
/// Which rows its tables have: all, or those that a person reads first, errors, their ratios, NEES
/// and the wall clock (without truth differences), with the number of those left out.
enum class ReportRows { kAll, kMain };
/// Its tables and the error decomposition.
std::string CompareReport(const Comparison& comparison, TableStyle style,
                          ReportRows rows = ReportRows::kAll);
/// All values, for other programs (docs/compare.md).
std::string CompareJson(const Comparison& comparison);

/// A new folder with compare.json, compare.md and compare.tex. Errors: kCannotCreate where it
/// exists without `force`, kIo.
void WriteComparison(const Comparison& comparison, const std::filesystem::path& folder, bool force);

}  // namespace alidade
