// SPDX-License-Identifier: Apache-2.0
#include "alidade/compare/conclusions.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>

#include "alidade/base/number_text.h"
#include "alidade/base/text.h"
#include "alidade/experiment/metric_key.h"
#include "alidade/experiment/metric_rows.h"
#include "alidade/sweep/conclusions.h"

namespace alidade::internal {
namespace {

using Tone = Conclusion::Tone;

/// Formats a number in the same way as the rows of metrics.
std::string CellOf(double value) {
  RunResult result;
  result.estimators.resize(1);
  result.estimators[0].metrics["value"] = value;
  return RowsOf(result, "value", "")[0].cells[0];
}

/// Relative differences of errors below this bound do not matter.
constexpr double kNegligible = 0.02;

/// Ratio of one subject in a step of the decomposition.
struct SubjectRatio {
  std::string subject;  ///< block, `map` or `map.sim3`
  Ratio ratio;

  /// Returns the change of the error, relative to the reference.
  double change() const { return ratio.value() - 1.0; }
  bool is_decided() const {
    constexpr double kRounding = 5e-4;
    return !ratio.undecided() && std::abs(change()) >= kRounding;
  }
};

/// Returns the ratio of the main error, or nullopt if the step has no ratios.
std::optional<SubjectRatio> MainRatio(const DecompositionStep& step) {
  std::vector<std::string> keys;
  for (const auto& [key, ratio] : step.ratios) keys.push_back(key);
  const std::string key = MainErrorKey(keys);
  if (key.empty()) return std::nullopt;
  return SubjectRatio{MetricKey::Parse(key).subject, step.ratios.at(key)};
}

/// Returns the ratios of all subjects, the main subject first.
std::string RatiosText(const DecompositionStep& step, const SubjectRatio& main) {
  std::vector<std::string> parts = {"ratio " + RatioText(main.ratio)};
  for (const auto& [key, ratio] : step.ratios) {
    const std::string subject = MetricKey::Parse(key).subject;
    if (subject != main.subject) parts.push_back(subject + ' ' + RatioText(ratio));
  }
  return Join(parts, "; ");
}

/// Returns `3 % more error` or `3 % less error`.
std::string ChangeText(double change) {
  return PercentText(std::abs(change)) + (change > 0.0 ? " more error" : " less error");
}

std::optional<Conclusion> Linearisation(const DecompositionStep& step) {
  const auto main = MainRatio(step);
  if (!main) return std::nullopt;
  const std::string place = " in " + main->subject + (step.at_end ? " at the last frame" : "");
  const bool is_negligible = !main->is_decided() || std::abs(main->change()) < kNegligible;
  const std::string text =
      !main->is_decided() ? step.estimator + " is as accurate as " + step.reference + place
      : is_negligible     ? step.estimator + " is within " + PercentText(std::abs(main->change())) +
                            " of " + step.reference + place
                      : step.estimator + " has " + ChangeText(main->change()) + " than " +
                            step.reference + place;
  return Conclusion{
      is_negligible ? Tone::kGood : Tone::kWarning,
      text + (is_negligible ? ": linearising each measurement only once costs nothing "
                              "that matters."
                            : ", because it linearises each measurement only once."),
      RatiosText(step, *main)};
}

std::optional<Conclusion> Smoothing(const DecompositionStep& step) {
  const auto main = MainRatio(step);
  if (!main) return std::nullopt;
  const std::string text = main->is_decided() && main->change() > 0.0
                               ? "Later data would divide the error of " + step.estimator + " in " +
                                     main->subject + " by " + RoundedText(main->ratio.value(), 3) +
                                     ": " + step.reference + " reaches this error."
                               : "Later data would not reduce the error of " + step.estimator +
                                     " in " + main->subject + '.';
  return Conclusion{Tone::kNeutral, text, RatiosText(step, *main)};
}

std::optional<Conclusion> Rejected(const DecompositionStep& step, const Comparison& comparison) {
  const auto rejected = step.values.find("rejected"), total = step.values.find("measurements");
  if (rejected == step.values.end() || total == step.values.end()) return std::nullopt;
  const std::string mean = comparison.runs > 1 ? " (mean of the runs)" : "";
  const std::string count = RoundedText(total->second.mean, 5) + " measurements" + mean;
  if (rejected->second.mean == 0.0) {
    return Conclusion{
        Tone::kGood,
        comparison.decomposed + " used all " + count + ": the rejection of outliers cost nothing.",
        ""};
  }
  std::string text = comparison.decomposed + " did not use " +
                     RoundedText(rejected->second.mean, 3) + " of " + count + '.';
  const auto main = MainRatio(step);
  if (!main) return Conclusion{Tone::kNeutral, text, ""};
  text += main->is_decided() ? " A batch without them has " + ChangeText(main->change()) + " in " +
                                   main->subject + " than a batch of all measurements."
                             : " They do not change the error of a batch in " + main->subject + '.';
  const bool is_costly = main->is_decided() && main->change() >= kNegligible;
  return Conclusion{is_costly ? Tone::kWarning : Tone::kNeutral, text, RatiosText(step, *main)};
}

std::optional<Conclusion> StepConclusion(const DecompositionStep& step,
                                         const Comparison& comparison) {
  switch (step.kind) {
    case DecompositionKind::kLinearisation:
      return Linearisation(step);
    case DecompositionKind::kSmoothing:
      return Smoothing(step);
    case DecompositionKind::kRejected:
      break;
  }
  return Rejected(step, comparison);
}

/// Returns the online estimator with the least positive value of a metric. Estimators that diverged
/// in a run are omitted. Returns null if no estimator has the metric.
const ComparedEstimator* FindLeast(const Comparison& comparison, const std::string& key) {
  const ComparedEstimator* least = nullptr;
  for (const ComparedEstimator& estimator : comparison.estimators) {
    const auto value = estimator.values.find(key);
    const bool is_known = value != estimator.values.end() && value->second.mean > 0.0;
    if (estimator.smoothed || estimator.diverged > 0 || !is_known) continue;
    const bool is_less = least == nullptr || value->second.mean < least->values.at(key).mean;
    if (is_less) least = &estimator;
  }
  return least;
}

/// Returns a sentence about the most accurate and the cheapest online estimator, or nullopt.
std::optional<Conclusion> AccuracyAndCost(const Comparison& comparison) {
  std::vector<std::string> keys;
  for (const ComparedEstimator& estimator : comparison.estimators) {
    for (const auto& [key, value] : estimator.values) keys.push_back(key);
  }
  const std::string key = MainErrorKey(keys);
  const ComparedEstimator* const best = FindLeast(comparison, key);
  const ComparedEstimator* const cheapest = FindLeast(comparison, "cpu_us");
  if (best == nullptr || cheapest == nullptr || best == cheapest) return std::nullopt;
  const auto error = cheapest->values.find(key);
  if (error == cheapest->values.end()) return std::nullopt;
  const std::string block = MetricKey::Parse(key).subject;
  const auto unit = best->units.find(block);
  const double change = error->second.mean / best->values.at(key).mean - 1.0;
  constexpr double kSame = 0.005;
  return Conclusion{
      Tone::kNeutral,
      "Least error online in " + block + ": " + best->name + ", " +
          ValueText(key, best->values.at(key).mean, unit == best->units.end() ? "" : unit->second) +
          ". Least CPU time: " + cheapest->name + ", " +
          RoundedText(cheapest->values.at("cpu_us").mean, 2) + " us a frame, with " +
          (change < kSame ? "the same error" : ChangeText(change)) + '.',
      ""};
}

std::vector<SweepSummary> SummariesOf(const Comparison& comparison) {
  std::vector<SweepSummary> summaries;
  for (const ComparedEstimator& estimator : comparison.estimators) {
    SweepSummary& summary = summaries.emplace_back();
    summary.name = estimator.name;
    summary.used = estimator.used;
    summary.diverged = estimator.diverged;
    summary.metrics = estimator.values;
    summary.units = estimator.units;
  }
  return summaries;
}

}  // namespace

std::string RatioText(const Ratio& ratio, bool with_interval) {
  const auto text = [](double value) { return FixedText(value, value < 10.0 ? 4 : 1); };
  if (!ratio.interval || ratio.error == ratio.reference_error) return CellOf(ratio.value());
  const Interval& interval = *ratio.interval;
  return text(ratio.value()) +
         (with_interval ? " [" + text(interval.low) + ", " + text(interval.high) + ']'
                        : " +- " + RoundedText(0.5 * (interval.high - interval.low), 2)) +
         (ratio.runs < kFewRuns ? " too few runs"
          : ratio.undecided()   ? " undecided"
                                : "");
}

std::vector<Conclusion> ConclusionsOf(const Comparison& comparison) {
  std::vector<Conclusion> conclusions;
  const auto append = [&](const std::optional<Conclusion>& conclusion) {
    if (conclusion) conclusions.push_back(*conclusion);
  };
  for (const DecompositionStep& step : comparison.decomposition) {
    append(StepConclusion(step, comparison));
  }
  append(AccuracyAndCost(comparison));
  if (comparison.runs > 1) {
    std::ranges::move(ConsistencyOf(SummariesOf(comparison)), std::back_inserter(conclusions));
  }
  return conclusions;
}

}  // namespace alidade::internal
