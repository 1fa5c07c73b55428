// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/run_conclusions.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "alidade/base/number_text.h"
#include "alidade/base/text.h"
#include "alidade/experiment/metric_key.h"
#include "alidade/experiment/metric_rows.h"

namespace alidade::internal {
namespace {

using Tone = Conclusion::Tone;

std::string TimeText(Timestamp timestamp) {
  return "t = " + NumberText(std::round(1e3 * Seconds(timestamp)) / 1e3) + " s";
}

/// Formats a length in m or mm.
std::string LengthText(double metres) { return ValueText("rmse:position", metres, "m"); }

/// Returns true if the estimates of an estimator can be judged by their errors.
bool IsReliable(const EstimatorResult& result) {
  return result.verdict.state > VerdictState::kMostlyRejected;
}

std::optional<Conclusion> ExcursionConclusion(const EstimatorResult& result,
                                              const EstimateHistory& history) {
  constexpr std::int64_t kShortest = 5;
  constexpr double kExpected = 0.003, kLeastShare = 0.02;
  const auto excursion = history.LongestExcursion();
  if (!excursion || !IsReliable(result)) return std::nullopt;
  const double share =
      static_cast<double>(excursion->outside) / static_cast<double>(history.rows());
  if (excursion->longest < kShortest || share <= kLeastShare) return std::nullopt;
  return Conclusion{Tone::kNeutral,
                    result.name + ": the error of " + excursion->element +
                        " is outside 3 sigma at " + std::to_string(excursion->outside) +
                        " timestamps, for the longest time from " + TimeText(excursion->first) +
                        " to " + TimeText(excursion->last) + '.',
                    PercentText(share) + "; " + PercentText(kExpected) + " expected"};
}

std::optional<Conclusion> FallConclusion(const EstimatorResult& result,
                                         const EstimateHistory& history) {
  const auto fall = history.LargestFall();
  if (!fall || result.smoothed) return std::nullopt;
  std::string text = result.name + ": at " + TimeText(fall->timestamp) + " the sigma of " +
                     history.position() + " fell from " + LengthText(fall->sigma_before) + " to " +
                     LengthText(fall->sigma_after);
  if (std::isfinite(fall->error_before) && std::isfinite(fall->error_after)) {
    text += ", and its error from " + LengthText(fall->error_before) + " to " +
            LengthText(fall->error_after);
  }
  return Conclusion{Tone::kNeutral, text + '.', "a loop closure or a first fix"};
}

/// Returns a sentence about the last estimates of the states of sensors, such as biases, whose true
/// values are unknown.
std::optional<Conclusion> SensorStates(const EstimatorResult& result,
                                       const EstimateHistory& history) {
  std::vector<std::string> parts;
  for (const FinalValue& final : history.FinalValues()) {
    const bool is_of_sensor =
        std::ranges::find(result.sensors, final.owner) != result.sensors.end();
    if (!is_of_sensor || !(final.sigma > 0.0)) continue;
    parts.push_back(final.element + ' ' + RoundedText(final.value, 4) + " +- " +
                    RoundedText(final.sigma, 2) + (final.unit.empty() ? "" : ' ' + final.unit));
  }
  if (parts.empty()) return std::nullopt;
  return Conclusion{Tone::kNeutral, result.name + " ends with " + Join(parts) + '.',
                    "1 sigma; without truth"};
}

/// Returns the key of the error that ranks the estimators, or "".
std::string MainErrorOf(const RunResult& result) {
  std::vector<std::string> keys;
  for (const EstimatorResult& estimator : result.estimators) {
    for (const auto& [key, value] : estimator.metrics) keys.push_back(key);
  }
  return MainErrorKey(keys);
}

/// Returns the reliable online estimators with a positive error, the most accurate first.
std::vector<const EstimatorResult*> Ranked(const RunResult& result, const std::string& key) {
  std::vector<const EstimatorResult*> ranked;
  const auto error = [&](const EstimatorResult* estimator) { return estimator->metrics.at(key); };
  for (const EstimatorResult& estimator : result.estimators) {
    const auto found = estimator.metrics.find(key);
    const bool is_known = found != estimator.metrics.end() && found->second > 0.0;
    if (is_known && !estimator.smoothed && IsReliable(estimator)) ranked.push_back(&estimator);
  }
  std::ranges::stable_sort(ranked, {}, error);
  return ranked;
}

std::optional<Conclusion> LeastError(const std::vector<const EstimatorResult*>& ranked,
                                     const std::string& key) {
  constexpr double kSame = 0.01;
  if (ranked.size() < 2) return std::nullopt;
  const EstimatorResult &best = *ranked[0], &second = *ranked[1];
  const double gain = 1.0 - best.metrics.at(key) / second.metrics.at(key);
  const std::string difference =
      gain < kSame ? "as accurate as " : PercentText(gain) + " less than ";
  return Conclusion{
      Tone::kNeutral,
      "Least rmse of " + MetricKey::Parse(key).subject + ": " + best.name + ", " +
          ValueText(best, key) + ", " + difference + second.name + '.',
      "one run; with simulated data, `alidade sweep --runs 100` shows whether the difference is "
      "chance"};
}

/// Returns a sentence about the errors of the best estimator in each segment of the config.
std::optional<Conclusion> SegmentErrors(const EstimatorResult& best, const std::string& key) {
  std::vector<std::string> parts;
  for (const auto& [text, value] : best.metrics) {
    const MetricKey parsed = MetricKey::Parse(text);
    const bool is_segment = !parsed.segment.empty() && text.starts_with(key + '@');
    if (is_segment && value > 0.0) {
      parts.push_back(ValueText(best, text) + " in segment " + parsed.segment);
    }
  }
  if (parts.empty()) return std::nullopt;
  return Conclusion{
      Tone::kNeutral,
      best.name + ": rmse of " + MetricKey::Parse(key).subject + ' ' + Join(parts) + '.', ""};
}

/// Returns a sentence about the position errors at the end of the path.
std::optional<Conclusion> Drift(const RunResult& result,
                                const std::vector<EstimateHistory>& histories) {
  std::vector<std::string> parts;
  double path = 0.0;
  for (std::size_t e = 0; e < histories.size(); ++e) {
    const EstimatorResult& estimator = result.estimators[e];
    const auto error = estimator.metrics.find("final_error:" + histories[e].position());
    if (error == estimator.metrics.end() || !(histories[e].path() > 0.0)) continue;
    if (!std::isfinite(error->second)) continue;
    path = std::max(path, histories[e].path());
    parts.push_back(estimator.name + ' ' + LengthText(error->second) + " (" +
                    PercentText(error->second / histories[e].path()) + ')');
  }
  if (parts.empty()) return std::nullopt;
  return Conclusion{
      Tone::kNeutral,
      "Path of " + LengthText(path) + "; position error at its end: " + Join(parts) + '.', ""};
}

/// Errors of the landmarks in the final state, the largest first.
struct MapErrors {
  std::vector<double> errors = {};
  std::int64_t outside = 0;  ///< landmarks with an error above 3 sigma

  double median() const { return errors[errors.size() / 2]; }
  /// Returns the RMSE without the first `omitted` errors.
  double Rmse(std::size_t omitted) const {
    double square = 0.0;
    for (std::size_t i = omitted; i < errors.size(); ++i) square += errors[i] * errors[i];
    return std::sqrt(square / static_cast<double>(errors.size() - omitted));
  }
};

MapErrors MapErrorsOf(const EstimatorResult& estimator) {
  MapErrors map;
  if (!estimator.landmarks) return map;
  for (const LandmarkEstimate& landmark : *estimator.landmarks) {
    const double error = (landmark.position - landmark.true_position).norm();
    if (!std::isfinite(error)) continue;
    map.errors.push_back(error);
    map.outside += error > 3.0 * std::sqrt(landmark.covariance.trace()) ? 1 : 0;
  }
  std::ranges::sort(map.errors, std::greater());
  return map;
}

std::string OutsideText(std::int64_t outside) {
  if (outside == 0) return "no error is above 3 sigma";
  return std::to_string(outside) + (outside == 1 ? " error is" : " errors are") + " above 3 sigma";
}

/// Returns a sentence about the map of an estimator. If a tenth of the landmarks causes most of the
/// error, the sentence also contains the RMSE of the others.
std::optional<Conclusion> MapConclusion(const EstimatorResult& estimator) {
  constexpr std::size_t kFewest = 5;
  constexpr double kMost = 0.8;
  const MapErrors map = MapErrorsOf(estimator);
  const std::size_t size = map.errors.size();
  if (size < kFewest) return std::nullopt;
  std::string text = estimator.name + ": map of " + std::to_string(size) +
                     " landmarks, median error " + LengthText(map.median()) + ", rmse " +
                     LengthText(map.Rmse(0));
  const std::size_t few = std::max<std::size_t>(1, size / 10);
  const double remaining = map.Rmse(few), all = map.Rmse(0);
  const double share = static_cast<double>(size - few) / static_cast<double>(size);
  if (remaining * remaining * share < (1.0 - kMost) * all * all) {
    text += "; " + LengthText(remaining) + " without the worst " +
            (few == 1 ? "one" : std::to_string(few));
  }
  return Conclusion{Tone::kNeutral, text + '.', OutsideText(map.outside)};
}

}  // namespace

std::vector<Conclusion> ConclusionsOf(const RunResult& result,
                                      const std::vector<EstimateHistory>& histories) {
  std::vector<Conclusion> conclusions;
  const auto append = [&](const std::optional<Conclusion>& conclusion) {
    if (conclusion) conclusions.push_back(*conclusion);
  };
  for (std::size_t e = 0; e < std::min(histories.size(), result.estimators.size()); ++e) {
    append(ExcursionConclusion(result.estimators[e], histories[e]));
    append(FallConclusion(result.estimators[e], histories[e]));
    append(SensorStates(result.estimators[e], histories[e]));
  }
  const std::string key = MainErrorOf(result);
  const std::vector<const EstimatorResult*> ranked = Ranked(result, key);
  append(LeastError(ranked, key));
  if (!ranked.empty()) append(SegmentErrors(*ranked.front(), key));
  if (histories.size() == result.estimators.size()) append(Drift(result, histories));
  for (const EstimatorResult& estimator : result.estimators) append(MapConclusion(estimator));
  return conclusions;
}

}  // namespace alidade::internal
