// SPDX-License-Identifier: Apache-2.0
#include "alidade/diagnosis/verdict.h"

#include <algorithm>

#include "alidade/base/number_text.h"
#include "alidade/base/statistics.h"
#include "alidade/diagnosis/time_series.h"
#include "alidade/estimation/recovery.h"

namespace alidade {
namespace {

using internal::RoundedText;

constexpr std::int64_t kMinSamples = 20;
/// Probabilities p of TestScale for a mean NEES: without and with a finding about the innovations.
/// A finding and a large NEES hardly ever occur together by chance.
constexpr double kAlone = 8e-7, kBesideFinding = 5e-3;

/// Returns the verdict `state` for the first event that satisfies `is_cause`.
template <class Predicate>
Verdict FromEvent(VerdictState state, std::span<const Event> events, const Predicate& is_cause) {
  const auto cause = std::ranges::find_if(events, is_cause);
  if (cause == events.end()) return {.state = state, .because = "the estimator ended early"};
  return {.state = state, .because = cause->text, .since = cause->timestamp};
}

std::optional<Verdict> FromRejections(std::span<const SensorUse> sensors) {
  for (const SensorUse& use : sensors) {
    const std::int64_t total = use.used + use.rejected;
    const bool at_end = use.rejected_in_a_row >= internal::Recovery::kMostlyRejected;
    if (!at_end && (2 * use.rejected <= total || total < kMinSamples)) continue;
    return Verdict{
        .state = VerdictState::kMostlyRejected,
        .because = use.RejectionText() +
                   (at_end ? ", and all of the last " + std::to_string(use.rejected_in_a_row) : ""),
        .since = at_end ? use.rejected_since : kNoTimestamp};
  }
  return std::nullopt;
}

/// Number of independent values whose mean is as certain as the mean of a series.
struct IndependentCount {
  double count = 1.0;
  const char* reason = "";  ///< reason why the series counts as one value, as a suffix
};

/// Counts the independent values of a series. The autocorrelation is about the mean of the series.
/// A short series hides slow components, so its time is multiplied by kSafety. If the values vary
/// much less than those of independent runs, as for a constant, the series counts as one value.
IndependentCount IndependentValues(const NeesSeries& series, double mean) {
  constexpr double kSmallestVariance = 0.25;  // relative to that of chi2(dof) / dof
  constexpr double kSafety = 5.0;
  const auto n = static_cast<double>(series.values.size());
  const double variance = SquaredDeviation(series.values) / n;
  if (variance < kSmallestVariance * 2.0 / series.dof * mean * mean) {
    return {.reason = " (nearly constant)"};
  }
  const double count = n / (kSafety * AutocorrelationTime(series.values, mean));
  if (count <= 1.0) return {.reason = " (strongly correlated)"};
  return {.count = count};
}

/// Returns the verdict of the NEES that is farthest from 1. TestScale has the probability p. Errors
/// that are all zero belong to a block that starts from the truth and is never corrected; they are
/// not tested.
Verdict FromNees(std::span<const NeesSeries> owners, double p) {
  Verdict verdict;
  verdict.state = VerdictState::kConsistent;
  verdict.basis = VerdictBasis::kNees;
  double worst = 1.0;
  std::string means;
  for (const NeesSeries& owner : owners) {
    if (std::ssize(owner.values) < kMinSamples) continue;
    const double mean = Mean(owner.values);
    if (mean == 0.0) continue;
    const IndependentCount independent = IndependentValues(owner, mean);
    const ScaleTest test = TestScale(mean, owner.dof, independent.count, p);
    means +=
        (means.empty() ? "" : ", ") + owner.owner + ' ' + RoundedText(mean, 3) + independent.reason;
    if (test == ScaleTest::kPassed) continue;
    const double distance = std::max(mean, 1.0 / mean);
    if (!(distance > worst)) continue;
    worst = distance;
    verdict.state =
        test == ScaleTest::kTooLarge ? VerdictState::kOverconfident : VerdictState::kUnderconfident;
    verdict.because = "the NEES of " + owner.owner + " is " + RoundedText(mean, 3) +
                      ", and 1 is expected: the errors are " + (mean > 1.0 ? "larger" : "smaller") +
                      " than P indicates";
  }
  if (means.empty()) {
    return {.because = "there are fewer than " + std::to_string(kMinSamples) +
                       " timestamps with truth, or all errors are zero"};
  }
  if (verdict.state == VerdictState::kConsistent) {
    verdict.because = "NEES " + means + " (1 is expected)";
  }
  return verdict;
}

/// Returns the verdict of the findings about the size of the innovations, if there are any. Its
/// reason is the first finding of all.
std::optional<Verdict> FromInnovationSizes(std::span<const Finding> findings) {
  for (const Finding& finding : findings) {
    const bool is_large = finding.kind == FindingKind::kOverconfident;
    if (!is_large && finding.kind != FindingKind::kUnderconfident) continue;
    return Verdict{.state = is_large ? VerdictState::kOverconfident : VerdictState::kUnderconfident,
                   .because = findings.front().text,
                   .basis = VerdictBasis::kNis};
  }
  return std::nullopt;
}

/// Returns the verdict without truth of an estimator whose innovations have the expected size.
Verdict WithoutTruth(const VerdictFacts& facts) {
  if (facts.tested_sensors == 0) {
    return {
        .because =
            "without truth, the test needs accepted measurements of a sensor without robust loss "
            "at " +
            std::to_string(kMinDiagnosedFrames) + " timestamps"};
  }
  return {.state = VerdictState::kConsistent,
          .because = "the NIS is as expected; without truth, the errors cannot be tested",
          .basis = VerdictBasis::kNis};
}

/// Returns the first verdict that applies.
Verdict VerdictOf(const VerdictFacts& facts) {
  const auto is_divergence = [](const Event& event) { return event.divergence; };
  const auto is_error = [](const Event& event) {
    return InfoOf(event.kind).severity == EventSeverity::kError;
  };
  if (facts.failed || facts.diverged) {
    const VerdictState state = facts.failed ? VerdictState::kFailed : VerdictState::kDiverged;
    return std::ranges::any_of(facts.events, is_divergence)
               ? FromEvent(state, facts.events, is_divergence)
               : FromEvent(state, facts.events, is_error);
  }
  if (!facts.run_failure.empty()) {
    return {.state = VerdictState::kFailed,
            .because = "the run ended early: " + std::string(facts.run_failure)};
  }
  const auto is_lost = [](const Event& event) { return event.kind == EventKind::kLost; };
  if (std::ranges::any_of(facts.events, is_lost)) {
    Verdict verdict = FromEvent(VerdictState::kLost, facts.events, is_lost);
    verdict.basis = VerdictBasis::kNees;
    return verdict;
  }
  if (const auto rejected = FromRejections(facts.sensors)) return *rejected;
  const auto is_used = [](const SensorUse& use) { return use.used > 0; };
  if (!facts.sensors.empty() && std::ranges::none_of(facts.sensors, is_used)) {
    return {.because = "no measurement was used"};
  }
  const double p = facts.findings.empty() ? kAlone : kBesideFinding;
  Verdict verdict = facts.nees.empty() ? WithoutTruth(facts) : FromNees(facts.nees, p);
  const bool is_wrong =
      verdict.basis == VerdictBasis::kNees && verdict.state != VerdictState::kConsistent;
  if (is_wrong) return verdict;
  if (const auto sizes = FromInnovationSizes(facts.findings)) return *sizes;
  if (!facts.findings.empty()) verdict.because += "; but " + facts.findings.front().text;
  return verdict;
}

}  // namespace

const char* ToString(VerdictBasis basis) {
  constexpr std::array kNames = {"none", "nis", "nees"};
  return kNames[static_cast<std::size_t>(basis)];
}

std::optional<VerdictState> VerdictStateOf(std::string_view name) {
  for (const VerdictInfo& info : kVerdicts) {
    if (name == info.name) return info.state;
  }
  return std::nullopt;
}

Verdict ComputeVerdict(const VerdictFacts& facts) {
  Verdict verdict = VerdictOf(facts);
  for (const EventKind kind :
       {EventKind::kUnused, EventKind::kNoMeasurement, EventKind::kDigitsLost}) {
    const auto event = std::ranges::find(facts.events, kind, &Event::kind);
    if (event == facts.events.end()) continue;
    verdict.because += kind == EventKind::kDigitsLost
                           ? "; sigmas may be wrong by rounding (event digits_lost)"
                           : "; " + event->text;
  }
  return verdict;
}

}  // namespace alidade
