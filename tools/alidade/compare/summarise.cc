// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "alidade/base/text.h"
#include "alidade/compare/compare.h"
#include "alidade/experiment/metric_key.h"
#include "alidade/experiment/metric_table.h"

namespace alidade {
namespace {

/// Collector of values over several comparisons, by key.
class ValueCollector {
 public:
  void Add(const std::map<std::string, Spread>& values) {
    for (const auto& [key, spread] : values) values_[key].push_back(spread.mean);
  }
  /// Computes the interval of the mean of each error metric.
  std::map<std::string, Interval> MeanIntervals() const {
    std::map<std::string, Interval> intervals;
    for (const auto& [key, list] : values_) {
      const MetricInfo* const metric = FindMetric(MetricKey::Parse(key).name);
      const bool is_error = metric != nullptr && metric->has_ratio;
      const bool has_nan = std::ranges::any_of(list, [](double v) { return std::isnan(v); });
      if (is_error && !has_nan && list.size() > 1) intervals[key] = IntervalOfMean(list);
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

/// Collector of ratios over several comparisons, by key.
class RatioCollector {
 public:
  void Add(const std::map<std::string, Ratio>& ratios) {
    for (const auto& [key, ratio] : ratios) {
      if (!std::isnan(ratio.value())) ratios_[key].push_back(ratio);
    }
  }
  std::map<std::string, Ratio> RatiosOfMeans() const {
    std::map<std::string, Ratio> ratios;
    for (const auto& [key, list] : ratios_) ratios[key] = RatioOfMeans(list);
    return ratios;
  }

 private:
  std::map<std::string, std::vector<Ratio>> ratios_;
};

bool Diverged(const Comparison& comparison, const std::string& name) {
  const auto found = std::ranges::find(comparison.estimators, name, &ComparedEstimator::name);
  return found != comparison.estimators.end() && found->diverged > 0;
}

/// Appends `name` to `names`, unless `name` is empty or already in `names`.
void AddName(const std::string& name, std::vector<std::string>& names) {
  if (!name.empty() && std::ranges::count(names, name) == 0) names.push_back(name);
}

ComparedEstimator SummariseEstimator(const std::vector<Comparison>& comparisons, std::size_t e) {
  ComparedEstimator summary = comparisons.front().estimators.at(e);
  summary.used = summary.diverged = summary.reference_runs = summary.final_reference_runs = 0;
  summary.verdicts = {};
  std::vector<std::string> references, final_references;
  ValueCollector values;
  RatioCollector ratios;
  std::vector<const ErrorSeries*> series;
  for (const Comparison& comparison : comparisons) {
    const ComparedEstimator& estimator = comparison.estimators.at(e);
    summary.diverged += estimator.diverged;
    for (std::size_t v = 0; v < summary.verdicts.size(); ++v) {
      summary.verdicts[v] += estimator.verdicts[v];
    }
    if (estimator.diverged > 0) continue;
    summary.used += 1;
    summary.reference_runs += estimator.reference_runs;
    summary.final_reference_runs += estimator.final_reference_runs;
    AddName(estimator.reference, references);
    AddName(estimator.final_reference, final_references);
    values.Add(estimator.values);
    ratios.Add(estimator.ratios);
    series.push_back(&estimator.series);
  }
  summary.reference = internal::Join(references);
  summary.final_reference = internal::Join(final_references);
  summary.mean_intervals = values.MeanIntervals();
  summary.values = std::move(values).Spreads();
  summary.ratios = ratios.RatiosOfMeans();
  summary.over_time = ComputeOverTime(series);
  summary.series = {};
  return summary;
}

std::string RunCountText(std::int64_t count, std::int64_t total) {
  return std::to_string(count) + " of " + std::to_string(total) + " runs";
}

/// Summarises a step. Uses only runs in which the filter did not diverge and in which the step is
/// between the same two estimators.
DecompositionStep SummariseStep(const std::vector<Comparison>& comparisons, std::size_t s) {
  const DecompositionStep* first_known = &comparisons.front().decomposition.at(s);
  for (const Comparison& comparison : comparisons) {
    if (first_known->withheld.empty()) break;
    first_known = &comparison.decomposition.at(s);
  }
  DecompositionStep summary = *first_known;
  ValueCollector values;
  RatioCollector ratios;
  for (const Comparison& comparison : comparisons) {
    const DecompositionStep& step = comparison.decomposition.at(s);
    const bool is_same = step.estimator == summary.estimator && step.reference == summary.reference;
    if (!is_same || Diverged(comparison, comparison.decomposed)) continue;
    values.Add(step.values);
    ratios.Add(step.ratios);
  }
  summary.values = std::move(values).Spreads();
  summary.ratios = ratios.RatiosOfMeans();
  return summary;
}

}  // namespace

Comparison Summarise(const std::vector<Comparison>& comparisons) {
  ALIDADE_EXPECTS(!comparisons.empty());
  Comparison summary = comparisons.front();
  summary.runs = std::ssize(comparisons);
  summary.status = RunStatus::kOk;  // the entries of the estimators report failures of single runs
  if (summary.runs > 1) summary.measurements_sha256.clear();
  summary.notes.clear();
  std::int64_t withheld_runs = 0;
  std::map<std::string, std::int64_t> runs_by_note;
  for (const Comparison& comparison : comparisons) {
    for (const std::string& note : comparison.notes) {
      if (++runs_by_note[note] == 1) summary.notes.push_back(note);
    }
    if (summary.reference.empty()) summary.reference = comparison.reference;
    if (comparison.withheld.empty()) continue;
    summary.withheld = comparison.withheld;
    ++withheld_runs;
  }
  if (withheld_runs > 0 && summary.runs > 1) {
    summary.withheld += " (" + RunCountText(withheld_runs, summary.runs) + ')';
  }
  for (std::string& note : summary.notes) {
    const std::int64_t runs = runs_by_note[note];
    if (runs < summary.runs) note += " (" + RunCountText(runs, summary.runs) + ')';
  }
  for (std::size_t e = 0; e < summary.estimators.size(); ++e) {
    summary.estimators[e] = SummariseEstimator(comparisons, e);
  }
  for (std::size_t i = 0; i < summary.decomposition.size(); ++i) {
    summary.decomposition[i] = SummariseStep(comparisons, i);
  }
  return summary;
}

}  // namespace alidade
