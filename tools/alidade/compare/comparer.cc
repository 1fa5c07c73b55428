// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <mutex>
#include <set>

#include "alidade/base/words.h"
#include "alidade/compare/candidates.h"
#include "alidade/record/data_hash.h"

namespace alidade {

using internal::ComparedEntry;
using internal::ComparedRun;

struct RunComparer::Impl {
  ComparedRun run;
  internal::DataHash data;
};

RunComparer::RunComparer(const Experiment& experiment)
    : impl_(std::make_unique<Impl>(Impl{
          {}, internal::DataHash(experiment.source->streams(), experiment.source->truths())})) {
  for (const NamedEstimator& named : experiment.estimators) {
    ComparedEntry& entry = impl_->run.estimators.emplace_back();
    entry.facts = internal::FactsOf(named, experiment);
    entry.series.blocks = entry.facts.blocks;
    entry.series.joint = entry.series.tangent() <= internal::Series::kMostJoint;
  }
}

RunComparer::~RunComparer() = default;

void RunComparer::OnFrame(const Frame& frame) { impl_->data.Add(frame); }

void RunComparer::OnEstimate(int estimator, const Frame& frame, const State& state,
                             const UpdateReport& report) {
  if (report.stale) return;
  impl_->run.estimators[static_cast<std::size_t>(estimator)].series.Append(frame.stamp, state);
}

Comparison RunComparer::Finish(const RunResult& result, const CompareOptions& options) {
  ComparedRun& run = impl_->run;
  run.status = result.status;
  run.reason = result.reason;
  run.reference = result.reference;
  run.frames = result.frames;
  run.unoptimised = result.unoptimised;
  run.measurements_sha256 = impl_->data.measurements();
  run.truth_sha256 = impl_->data.truth();
  ALIDADE_EXPECTS(result.estimators.size() <= run.estimators.size());
  for (std::size_t e = 0; e < result.estimators.size(); ++e) {
    run.estimators[e].result = result.estimators[e];
    run.estimators[e].had_rejection_recovery =
        std::ranges::count(result.estimators[e].events, "rejection_recovery", &Event::kind) > 0;
    run.estimators[e].result.events.clear();
  }
  run.estimators.resize(result.estimators.size());
  std::vector<ComparedRun> runs;
  runs.push_back(std::move(run));
  return internal::CompareRuns(runs, options);
}

Comparison CompareFolders(const std::vector<std::filesystem::path>& folders,
                          const CompareOptions& options) {
  ALIDADE_EXPECTS(!folders.empty());
  std::set<std::filesystem::path> distinct;
  for (const auto& folder : folders) {
    if (distinct.insert(std::filesystem::weakly_canonical(folder)).second) continue;
    throw Error(ExitCode::kUsage, ErrorLine(Place{folder.string()}, {}, "is given twice",
                                            "folders of different runs"));
  }
  std::vector<ComparedRun> runs;
  for (const auto& folder : folders) runs.push_back(internal::ReadRun(folder));
  std::vector<std::string> notes = internal::CheckSameData(runs);
  for (const ComparedRun& run : runs) {
    for (const internal::ComparedEntry& entry : run.estimators) {
      if (entry.not_finite == 0) continue;
      notes.push_back("'" + (run.folder / entry.result.name / "estimates.csv").string() + "': " +
                      std::to_string(entry.not_finite) + " of " + std::to_string(entry.facts.rows) +
                      " rows have values that are not finite; the comparison leaves these out");
    }
    if (run.status == RunStatus::kOk) continue;
    notes.push_back("'" + run.folder.string() + "' " + ToString(run.status) + ": " + run.reason);
  }
  Comparison comparison = internal::CompareRuns(runs, options);
  comparison.notes.insert(comparison.notes.begin(), notes.begin(), notes.end());
  return comparison;
}

ComparedSeeds CompareSeeds(const ExplainedExperiment& explained, const PluginHost& host,
                           const SweepOptions& sweep, const CompareOptions& options) {
  std::mutex mutex;
  std::map<std::uint64_t, Comparison> by_seed;
  SweepOptions with = sweep;
  with.run = [&](Experiment& experiment, const RunOptions& given) {
    RunComparer comparer(experiment);
    RunOptions observed = given;
    observed.observers.push_back(&comparer);
    RunResult result = Run(experiment, observed);
    const bool whole = result.code == ExitCode::kDiverged || result.status == RunStatus::kOk;
    if (!whole) return result;
    CompareOptions of_run = options;
    of_run.filter = explained.filter;
    Comparison comparison = comparer.Finish(result, of_run);
    const std::lock_guard lock(mutex);
    by_seed.emplace(experiment.seed, std::move(comparison));
    return result;
  };
  ComparedSeeds seeds{{}, Sweep(explained.config, host, with)};
  std::vector<Comparison> comparisons;
  for (auto& [seed, comparison] : by_seed) comparisons.push_back(std::move(comparison));
  if (!comparisons.empty()) seeds.comparison = Summarise(comparisons);
  if (seeds.sweep.stopped) seeds.comparison.status = RunStatus::kStopped;
  return seeds;
}

namespace {

/// Gathers values of one thing over several comparisons.
class Gathered {
 public:
  void Add(const std::map<std::string, Spread>& values) {
    for (const auto& [key, spread] : values) values_[key].push_back(spread.mean);
  }
  std::map<std::string, Spread> Spreads() && {
    std::map<std::string, Spread> spreads;
    for (auto& [key, list] : values_) spreads[key] = SpreadOf(std::move(list));
    return spreads;
  }

 private:
  std::map<std::string, std::vector<double>> values_;
};

bool Diverged(const Comparison& comparison, const std::string& name) {
  const auto found = std::ranges::find(comparison.estimators, name, &ComparedEstimator::name);
  return found != comparison.estimators.end() && found->diverged > 0;
}

/// Appends `name` to those before it, where it is new.
void AddName(const std::string& name, std::vector<std::string>& names) {
  if (!name.empty() && std::ranges::count(names, name) == 0) names.push_back(name);
}

ComparedEstimator SummariseEstimator(const std::vector<Comparison>& comparisons, std::size_t e) {
  ComparedEstimator all = comparisons.front().estimators.at(e);
  all.used = all.diverged = all.reference_runs = all.final_reference_runs = 0;
  std::vector<std::string> references, final_references;
  Gathered gathered;
  for (const Comparison& one : comparisons) {
    const ComparedEstimator& of_run = one.estimators.at(e);
    all.diverged += of_run.diverged;
    if (of_run.diverged > 0) continue;
    all.used += 1;
    all.reference_runs += of_run.reference_runs;
    all.final_reference_runs += of_run.final_reference_runs;
    AddName(of_run.reference, references);
    AddName(of_run.final_reference, final_references);
    gathered.Add(of_run.values);
  }
  all.reference = internal::Join(references);
  all.final_reference = internal::Join(final_references);
  all.values = std::move(gathered).Spreads();
  return all;
}

std::string OfRuns(std::int64_t some, std::int64_t all) {
  return std::to_string(some) + " of " + std::to_string(all) + " runs";
}

/// Of the runs in which the filter did not diverge, those that have the step between the same two.
DecompositionStep SummariseStep(const std::vector<Comparison>& comparisons, std::size_t s) {
  const DecompositionStep* known = &comparisons.front().decomposition.at(s);
  for (const Comparison& one : comparisons) {
    if (known->withheld.empty()) break;
    known = &one.decomposition.at(s);
  }
  DecompositionStep all = *known;
  Gathered gathered;
  for (const Comparison& one : comparisons) {
    const DecompositionStep& of_run = one.decomposition.at(s);
    const bool same = of_run.from == all.from && of_run.to == all.to;
    if (same && !Diverged(one, one.explained)) gathered.Add(of_run.values);
  }
  all.values = std::move(gathered).Spreads();
  return all;
}

}  // namespace

Comparison Summarise(const std::vector<Comparison>& comparisons) {
  ALIDADE_EXPECTS(!comparisons.empty());
  Comparison all = comparisons.front();
  all.runs = std::ssize(comparisons);
  all.status = RunStatus::kOk;  // what failed in a run is told of its estimators
  if (all.runs > 1) all.measurements_sha256.clear();
  all.notes.clear();
  std::int64_t withheld = 0;
  std::map<std::string, std::int64_t> with_note;
  for (const Comparison& one : comparisons) {
    for (const std::string& note : one.notes) {
      if (++with_note[note] == 1) all.notes.push_back(note);
    }
    if (all.reference.empty()) all.reference = one.reference;
    if (one.withheld.empty()) continue;
    all.withheld = one.withheld;
    ++withheld;
  }
  if (withheld > 0 && all.runs > 1) {
    all.withheld += " (" + OfRuns(withheld, all.runs) + ')';
  }
  for (std::string& note : all.notes) {
    const std::int64_t runs = with_note[note];
    if (runs < all.runs) note += " (" + OfRuns(runs, all.runs) + ')';
  }
  for (std::size_t e = 0; e < all.estimators.size(); ++e) {
    all.estimators[e] = SummariseEstimator(comparisons, e);
  }
  for (std::size_t i = 0; i < all.decomposition.size(); ++i)
    all.decomposition[i] = SummariseStep(comparisons, i);
  return all;
}

}  // namespace alidade
