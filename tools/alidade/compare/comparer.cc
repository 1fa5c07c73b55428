// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <mutex>
#include <set>

#include "alidade/base/number_text.h"
#include "alidade/compare/budget.h"
#include "alidade/compare/candidates.h"
#include "alidade/compare/error_recorder.h"
#include "alidade/record/data_hash.h"

namespace alidade {

using internal::Candidate;
using internal::ComparedRun;

struct RunComparer::Impl {
  ComparedRun run;
  internal::DataHash data;
  std::vector<std::shared_ptr<internal::CpuTime>> clocks = {};
  /// Recorder of each estimator; empty if the run is not one of several seeds.
  std::vector<internal::ErrorRecorder> errors = {};
};

RunComparer::RunComparer(Experiment& experiment, bool over_seeds)
    : impl_(std::make_unique<Impl>(Impl{
          {}, internal::DataHash(experiment.source->streams(), experiment.source->truths())})) {
  for (EstimatorSpec& spec : experiment.estimators) {
    Candidate& candidate = impl_->run.estimators.emplace_back();
    impl_->clocks.push_back(std::make_shared<internal::CpuTime>());
    spec.estimator = internal::WithCpuClock(std::move(spec.estimator), impl_->clocks.back());
    if (over_seeds) impl_->errors.emplace_back(spec, experiment);
    candidate.series.blocks = internal::SeriesBlocksOf(spec.problem);
    candidate.series.joint = candidate.series.tangent() <= internal::Series::kMaxJoint;
  }
}

RunComparer::~RunComparer() = default;

void RunComparer::OnFrame(const SourceFrame& frame) { impl_->data.Add(frame); }

void RunComparer::OnEstimate(int estimator, const SourceFrame& frame, const State& state,
                             const UpdateReport& report) {
  if (report.stale) return;
  const auto index = static_cast<std::size_t>(estimator);
  impl_->run.estimators[index].series.Append(frame.timestamp, state);
  if (!impl_->errors.empty()) impl_->errors[index].Add(frame, state);
}

Comparison RunComparer::Finish(const RunResult& result, const CompareOptions& options) {
  ComparedRun& run = impl_->run;
  run.status = result.status;
  run.reason = result.reason;
  run.reference = result.reference;
  run.frames = result.frames;
  run.measurements_sha256 = impl_->data.measurements();
  run.truth_sha256 = impl_->data.truth();
  ALIDADE_EXPECTS(result.estimators.size() <= run.estimators.size());
  for (std::size_t e = 0; e < result.estimators.size(); ++e) {
    run.estimators[e].result = result.estimators[e];
    run.estimators[e].cpu = *impl_->clocks[e];
    if (!impl_->errors.empty()) run.estimators[e].errors = impl_->errors[e].Finish();
    run.estimators[e].had_rejection_recovery =
        std::ranges::count(result.estimators[e].events, EventKind::kRejectionRecovery,
                           &Event::kind) > 0;
    run.estimators[e].result.events.clear();
  }
  run.estimators.resize(result.estimators.size());
  std::vector<ComparedRun> runs;
  runs.push_back(std::move(run));
  return internal::CompareRuns(std::move(runs), options);
}

Comparison CompareFolders(const std::vector<std::filesystem::path>& folders,
                          const CompareOptions& options) {
  ALIDADE_EXPECTS(!folders.empty());
  std::set<std::filesystem::path> distinct;
  for (const auto& folder : folders) {
    if (distinct.insert(std::filesystem::weakly_canonical(folder)).second) continue;
    throw Error(ExitCode::kUsage,
                ErrorLine(Place{folder.string()}, {}, "this folder is given twice",
                          "folders of different runs"));
  }
  std::vector<ComparedRun> runs;
  for (const auto& folder : folders) runs.push_back(internal::ReadRun(folder));
  std::vector<std::string> notes = internal::CheckSameData(runs);
  for (const ComparedRun& run : runs) {
    for (const Candidate& candidate : run.estimators) {
      if (candidate.not_finite_rows == 0) continue;
      notes.push_back("'" + (run.folder / candidate.result.name / "estimates.csv").string() +
                      "': " + std::to_string(candidate.not_finite_rows) + " of " +
                      std::to_string(candidate.series.timestamps.size()) +
                      " rows contain values that are not finite; the comparison ignores these "
                      "values");
    }
    if (run.status == RunStatus::kOk) continue;
    notes.push_back("the run in '" + run.folder.string() + "' " + ToString(run.status) + ": " +
                    run.reason);
  }
  Comparison comparison = internal::CompareRuns(std::move(runs), options);
  comparison.notes.insert(comparison.notes.begin(), notes.begin(), notes.end());
  return comparison;
}

ComparedSeeds CompareSeeds(const ComparedExperiment& compared, const PluginHost& host,
                           const SweepOptions& sweep, const CompareOptions& options) {
  std::mutex mutex;
  std::map<std::uint64_t, Comparison> by_seed;
  internal::RunBudget budget(options.budget_s);
  const auto stopped = [&] { return sweep.stop && sweep.stop(); };
  SweepOptions sweep_options = sweep;
  sweep_options.stop = [&] { return stopped() || budget.is_spent(); };
  sweep_options.run = [&](Experiment& experiment, const RunOptions& original) {
    RunComparer comparer(experiment, true);
    RunOptions observed = original;
    observed.observers.push_back(&comparer);
    // The budget does not stop a started run, because the time of this run is part of the budget.
    observed.stop = stopped;
    const double start_s = budget.elapsed_s();
    RunResult result = sweep.run ? sweep.run(experiment, observed) : Run(experiment, observed);
    budget.RecordRun(budget.elapsed_s() - start_s);
    const bool is_finished = result.code == ExitCode::kDiverged || result.status == RunStatus::kOk;
    if (!is_finished) return result;
    CompareOptions run_options = options;
    run_options.filter = compared.filter;
    Comparison comparison = comparer.Finish(result, run_options);
    const std::lock_guard lock(mutex);
    by_seed.emplace(experiment.seed, std::move(comparison));
    return result;
  };
  ComparedSeeds seeds{{}, Sweep(compared.config, host, sweep_options)};
  const std::int64_t finished = std::ssize(seeds.sweep.done);
  std::vector<Comparison> comparisons;
  for (auto& [seed, comparison] : by_seed) comparisons.push_back(std::move(comparison));
  if (!comparisons.empty()) seeds.comparison = Summarise(comparisons);
  if (seeds.sweep.stopped && stopped()) {
    seeds.comparison.status = RunStatus::kStopped;
  } else if (seeds.sweep.stopped) {
    seeds.beyond_budget = seeds.sweep.runs - finished;
    seeds.comparison.notes.push_back(
        "the budget of " + internal::RoundedText(*options.budget_s, 3) + " s sufficed for " +
        std::to_string(finished) + " of " + std::to_string(seeds.sweep.runs) + " runs; seed " +
        std::to_string(seeds.sweep.first_seed + static_cast<std::uint64_t>(finished)) +
        " and the later seeds were not run");
  }
  return seeds;
}

}  // namespace alidade
