// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "alidade/base/text.h"
#include "alidade/compare/compare.h"

namespace alidade {
namespace {

/// Gathers values of one thing over several comparisons.
class Gathered {
 public:
  void Add(const std::map<std::string, Spread>& values) {
    for (const auto& [key, spread] : values) values_[key].push_back(spread.mean);
  }
  /// Of the mean of each error.
  std::map<std::string, Interval> MeanIntervals() const {
    std::map<std::string, Interval> intervals;
    for (const auto& [key, list] : values_) {
      const bool is_error = key.starts_with("rmse:") || key.starts_with("final_error:") ||
                            key == "map.rmse" || key == "map.sim3.rmse";
      const bool known = std::ranges::none_of(list, [](double v) { return std::isnan(v); });
      if (is_error && known && list.size() > 1) intervals[key] = IntervalOfMean(list);
    }
    return intervals;
  }
  std::map<std::string, Spread> Spreads() && {
    std::map<std::string, Spread> spreads;
    for (auto& [key, list] : values_) spreads[key] = SpreadOf(std::move(list));
    return spreads;
  }

 private:
  std::map<std::string, std::vector<double>> values_;
};

/// Gathers ratios likewise.
class GatheredRatios {
 public:
  void Add(const std::map<std::string, Ratio>& ratios) {
    for (const auto& [key, ratio] : ratios) {
      if (!std::isnan(ratio.value())) ratios_[key].push_back(ratio);
    }
  }
  std::map<std::string, Ratio> OfMeans() const {
    std::map<std::string, Ratio> of_means;
    for (const auto& [key, list] : ratios_) of_means[key] = RatioOfMeans(list);
    return of_means;
  }

 private:
  std::map<std::string, std::vector<Ratio>> ratios_;
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
  GatheredRatios ratios;
  std::vector<const ErrorSeries*> series;
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
    ratios.Add(of_run.ratios);
    series.push_back(&of_run.series);
  }
  all.reference = internal::Join(references);
  all.final_reference = internal::Join(final_references);
  all.mean_intervals = gathered.MeanIntervals();
  all.values = std::move(gathered).Spreads();
  all.ratios = ratios.OfMeans();
  all.over_time = OverRuns(series);
  all.series = {};
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
  GatheredRatios ratios;
  for (const Comparison& one : comparisons) {
    const DecompositionStep& of_run = one.decomposition.at(s);
    const bool same = of_run.from == all.from && of_run.to == all.to;
    if (!same || Diverged(one, one.decomposed)) continue;
    gathered.Add(of_run.values);
    ratios.Add(of_run.ratios);
  }
  all.values = std::move(gathered).Spreads();
  all.ratios = ratios.OfMeans();
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
