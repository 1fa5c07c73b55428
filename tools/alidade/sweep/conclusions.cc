// SPDX-License-Identifier: Apache-2.0
#include "alidade/sweep/conclusions.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <optional>

#include "alidade/base/number_text.h"
#include "alidade/base/text.h"
#include "alidade/experiment/metric_key.h"
#include "alidade/experiment/metric_rows.h"
#include "alidade/sweep/table.h"

namespace alidade::internal {
namespace {

using Tone = Conclusion::Tone;

/// Mean NEES of an owner over the runs, and its test.
struct OwnerNees {
  std::string owner;
  double mean;
  std::int64_t count;  ///< number of runs
  Interval bounds;     ///< 95 % bounds of the mean
  ScaleTest test;

  bool is_inside() const { return mean >= bounds.low && mean <= bounds.high; }
};

/// Returns the mean NEES of each owner over at least two runs. Omits an owner whose NEES is zero,
/// because its blocks are known exactly.
std::vector<OwnerNees> NeesOf(const SweepSummary& summary) {
  std::vector<OwnerNees> owners;
  for (const auto& [key, bounds] : NeesBounds(summary)) {
    const std::string owner = MetricKey::Parse(key).subject;
    const auto mean = summary.metrics.find(key), dof = summary.metrics.find("nees.dof:" + owner);
    if (mean == summary.metrics.end() || !std::isfinite(mean->second.mean)) continue;
    const double value = mean->second.mean;
    const std::int64_t count = dof->second.count;
    if (value == 0.0 || count < 2) continue;
    owners.push_back({owner, value, count, bounds,
                      TestScale(value, dof->second.mean, static_cast<double>(count))});
  }
  return owners;
}

bool IsInside(const OwnerNees& nees) { return nees.is_inside(); }

std::string NeesText(const OwnerNees& nees) {
  return "NEES " + nees.owner + ' ' + RoundedText(nees.mean, 3) + ", 95 % bounds " +
         IntervalText(nees.bounds.low, nees.bounds.high);
}

/// Returns the mean of a metric over at least two used runs. Returns nullopt if the estimator
/// diverged in some run, because the means of different runs cannot be compared.
std::optional<double> ComparableMean(const SweepSummary& summary, const std::string& key) {
  const auto found = summary.metrics.find(key);
  const bool is_known = found != summary.metrics.end() && std::isfinite(found->second.mean);
  if (!is_known || summary.diverged > 0 || summary.used < 2) return std::nullopt;
  return found->second.mean;
}

std::string MeanText(const SweepSummary& summary, const std::string& key) {
  const auto unit = summary.units.find(MetricKey::Parse(key).subject);
  return ValueText(key, summary.metrics.at(key).mean,
                   unit == summary.units.end() ? "" : unit->second);
}

/// Returns `rmse of target.depth` for `rmse:target.depth`.
std::string MetricName(const std::string& key) {
  const MetricKey parsed = MetricKey::Parse(key);
  return parsed.name + (parsed.subject.empty() ? "" : " of " + parsed.subject);
}

/// Returns the sorted pairs of a comparable mean and the index of its summary.
std::vector<std::pair<double, std::size_t>> RankedMeans(const std::vector<SweepSummary>& summaries,
                                                        const std::string& key) {
  std::vector<std::pair<double, std::size_t>> ranked;
  for (std::size_t i = 0; i < summaries.size(); ++i) {
    if (const auto mean = ComparableMean(summaries[i], key)) ranked.emplace_back(*mean, i);
  }
  std::ranges::sort(ranked);
  return ranked;
}

/// Returns the key of the error that ranks estimators, or "".
std::string MainErrorOf(const std::vector<SweepSummary>& summaries) {
  std::vector<std::string> keys;
  for (const SweepSummary& summary : summaries) {
    for (const auto& [key, spread] : summary.metrics) keys.push_back(key);
  }
  return MainErrorKey(keys);
}

/// Counts the runs in which the error of `worse` is larger, and all runs with both errors.
std::pair<std::int64_t, std::int64_t> CountLarger(const SweepResult& result, const std::string& key,
                                                  const std::string& better,
                                                  const std::string& worse) {
  std::int64_t larger = 0, all = 0;
  for (const SweepRun& run : result.done) {
    const double* values[2] = {nullptr, nullptr};
    for (const SweepRow& row : run.estimators) {
      if (!run.UsesMetricsOf(row)) continue;
      if (row.name == better) values[0] = row.metrics.Find(key);
      if (row.name == worse) values[1] = row.metrics.Find(key);
    }
    if (values[0] == nullptr || values[1] == nullptr) continue;
    ++all;
    larger += *values[1] > *values[0] ? 1 : 0;
  }
  return {larger, all};
}

std::optional<Conclusion> LeastError(const SweepResult& result,
                                     const std::vector<SweepSummary>& summaries) {
  const std::string key = MainErrorOf(summaries);
  const auto ranked = RankedMeans(summaries, key);
  if (ranked.size() < 2) return std::nullopt;
  const SweepSummary &best = summaries[ranked[0].second], &second = summaries[ranked[1].second];
  const auto [larger, all] = CountLarger(result, key, best.name, second.name);
  return Conclusion{Tone::kNeutral,
                    best.name + " has the least " + MetricName(key) + ": " + MeanText(best, key) +
                        ", mean of " + std::to_string(best.used) + " runs. " + second.name +
                        " has " + MeanText(second, key) + ", and more than " + best.name + " in " +
                        std::to_string(larger) + " of " + std::to_string(all) + " runs.",
                    ""};
}

/// Returns a sentence about divergence, or nullopt. `place` follows the name of the estimator.
std::optional<Conclusion> Divergence(const SweepSummary& summary, const std::string& place) {
  const std::int64_t runs = summary.used + summary.diverged;
  if (summary.diverged == 0) return std::nullopt;
  const Interval share = ShareInterval(summary.diverged, runs);
  return Conclusion{Tone::kBad,
                    summary.name + " diverged" + place + " in " + std::to_string(summary.diverged) +
                        " of " + std::to_string(runs) + " runs.",
                    "95 % interval " + PercentText(share.low) + " to " + PercentText(share.high)};
}

/// Returns one sentence for all estimators whose mean NEES is inside its bounds.
std::optional<Conclusion> Consistency(const std::vector<SweepSummary>& summaries) {
  constexpr std::size_t kMaxDetails = 3;
  std::vector<std::string> names, details;
  for (const SweepSummary& summary : summaries) {
    const std::vector<OwnerNees> owners = NeesOf(summary);
    if (owners.empty() || !std::ranges::all_of(owners, IsInside)) continue;
    names.push_back(summary.name);
    for (const OwnerNees& nees : owners) details.push_back(summary.name + ": " + NeesText(nees));
  }
  if (names.empty()) return std::nullopt;
  if (names.size() > kMaxDetails) details.clear();
  return Conclusion{
      Tone::kGood,
      JoinNames(names) + (names.size() > 1 ? " are" : " is") + " consistent over the runs.",
      Join(details, "; ")};
}

/// Returns a sentence for each mean NEES that is outside its bounds.
std::vector<Conclusion> Inconsistencies(const SweepSummary& summary) {
  std::vector<Conclusion> list;
  for (const OwnerNees& nees : NeesOf(summary)) {
    if (nees.is_inside()) continue;
    const bool is_large = nees.mean > nees.bounds.high;
    const std::string word = is_large ? "overconfident" : "underconfident";
    const std::string start = summary.name + ": over " + std::to_string(nees.count) +
                              " runs, the NEES of " + nees.owner + " is " +
                              RoundedText(nees.mean, 3) + ", and 1 is expected: ";
    if (nees.test == ScaleTest::kPassed) {
      list.push_back({Tone::kNeutral, start + "the filter may be slightly " + word + '.',
                      "95 % bounds " + IntervalText(nees.bounds.low, nees.bounds.high)});
    } else {
      list.push_back(
          {Tone::kWarning,
           start + "the filter is " + word + ", even if single runs are too short to show it.",
           ""});
    }
  }
  return list;
}

/// Summaries of one estimator, one for each value.
using SummariesByValue = std::vector<SweepSummary>;

std::optional<Conclusion> BestValue(const Variation& variation, const SummariesByValue& summaries) {
  const std::string key = MainErrorOf(summaries);
  const auto ranked = RankedMeans(summaries, key);
  if (ranked.size() < 2) return std::nullopt;
  const auto text = [&](std::size_t i) {
    return variation.values[i] + " (" + MeanText(summaries[i], key) + ')';
  };
  return Conclusion{Tone::kNeutral,
                    summaries.front().name + " has the least " + MetricName(key) + " at " +
                        variation.key + " = " + text(ranked[0].second) + ", then at " +
                        text(ranked[1].second) + ". The errors are means of the runs.",
                    ""};
}

/// Values of the varied key at which the filter is in a state, and the NEES behind it.
struct ValuesInState {
  const char* state;
  Tone tone;
  std::vector<std::string> values = {}, details = {};

  void Add(const std::string& value, const std::vector<OwnerNees>& owners) {
    values.push_back(value);
    for (const OwnerNees& nees : owners) details.push_back(value + ": " + NeesText(nees));
  }
};

/// Returns sentences about the values at which an estimator is consistent, overconfident or
/// underconfident. A value at which the mean NEES is outside its bounds, but passes TestScale, is
/// omitted.
std::vector<Conclusion> ConsistencyByValue(const Variation& variation,
                                           const SummariesByValue& summaries) {
  std::array<ValuesInState, 3> states = {{{"consistent", Tone::kGood},
                                          {"overconfident", Tone::kWarning},
                                          {"underconfident", Tone::kWarning}}};
  for (std::size_t v = 0; v < summaries.size(); ++v) {
    const std::vector<OwnerNees> owners = NeesOf(summaries[v]);
    const auto has = [&](ScaleTest test) {
      return std::ranges::any_of(owners, [&](const OwnerNees& nees) { return nees.test == test; });
    };
    if (owners.empty()) continue;
    const std::string& value = variation.values[v];
    if (std::ranges::all_of(owners, IsInside)) states[0].Add(value, owners);
    if (has(ScaleTest::kTooLarge)) states[1].Add(value, owners);
    if (has(ScaleTest::kTooSmall)) states[2].Add(value, owners);
  }
  std::vector<Conclusion> conclusions;
  for (const ValuesInState& entry : states) {
    if (entry.values.empty()) continue;
    conclusions.push_back({entry.tone,
                           summaries.front().name + " is " + entry.state + " over the runs at " +
                               variation.key + " = " + JoinNames(entry.values) + '.',
                           Join(entry.details, "; ")});
  }
  return conclusions;
}

void Append(std::optional<Conclusion> conclusion, std::vector<Conclusion>& conclusions) {
  if (conclusion) conclusions.push_back(*std::move(conclusion));
}

}  // namespace

std::vector<Conclusion> ConsistencyOf(const std::vector<SweepSummary>& summaries) {
  std::vector<Conclusion> conclusions;
  Append(Consistency(summaries), conclusions);
  for (const SweepSummary& summary : summaries) {
    Append(Divergence(summary, ""), conclusions);
    std::ranges::move(Inconsistencies(summary), std::back_inserter(conclusions));
  }
  return conclusions;
}

std::vector<Conclusion> ConclusionsOf(const SweepResult& result,
                                      const std::vector<SweepSummary>& summaries) {
  std::vector<Conclusion> conclusions = ConsistencyOf(summaries);
  if (auto least = LeastError(result, summaries)) {
    conclusions.insert(conclusions.begin(), *std::move(least));
  }
  return conclusions;
}

std::vector<Conclusion> ConclusionsOf(const VariedSweep& sweep) {
  std::vector<SummariesByValue> estimators;
  for (const SweepResult& result : sweep.results) {
    std::vector<SweepSummary> summaries = Summarise(result);
    estimators.resize(summaries.size());
    for (std::size_t i = 0; i < summaries.size(); ++i) {
      estimators[i].push_back(std::move(summaries[i]));
    }
  }
  std::vector<Conclusion> conclusions;
  for (const SummariesByValue& summaries : estimators) {
    Append(BestValue(sweep.variation, summaries), conclusions);
    for (std::size_t v = 0; v < summaries.size(); ++v) {
      const std::string place = " at " + sweep.variation.key + " = " + sweep.variation.values[v];
      Append(Divergence(summaries[v], place), conclusions);
    }
    std::ranges::move(ConsistencyByValue(sweep.variation, summaries),
                      std::back_inserter(conclusions));
  }
  return conclusions;
}

}  // namespace alidade::internal
