// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/diagnosis.h"

#include <span>

#include "alidade/base/number_text.h"
#include "alidade/base/text.h"
#include "alidade/experiment/map_metrics.h"
#include "alidade/experiment/metric_key.h"
#include "alidade/experiment/run_log.h"

namespace alidade::internal {
namespace {

/// Adds an event `unit` for each sensor whose measurements may have the wrong unit
/// (Metrics::far_off_sensors).
void AddUnitEvents(const Problem& problem, const Metrics& metrics, EstimatorResult& result) {
  for (const int index : metrics.far_off_sensors()) {
    const SensorBinding& sensor = problem.sensors[static_cast<std::size_t>(index)];
    const Space& measured = sensor.model->measurement();
    const bool is_angle = measured.geometry.is_angle();
    const std::string unit = measured.unit.empty() ? "the model's units" : measured.unit;
    result.events.push_back(
        {kNoTimestamp, EventKind::kUnit,
         "sensor '" + sensor.name + "': most measurements z and their predictions h differ by " +
             (is_angle ? "more than 5 sigma, with |z - h| > pi / 4 or |z| > 2 pi"
                       : "more than 100 sigma") +
             "; is stream '" + sensor.stream + "' in " + (is_angle ? "rad" : unit) + '?'});
  }
}

/// Adds an event `nees_bounds` or `nis_bounds` for each mean of NEES or NIS that is outside its 95
/// % bounds.
void AddConsistencyEvents(EstimatorResult& result) {
  const auto add_events = [&](EventKind event, const std::string& kind, const std::string& name,
                              const std::string& subject_kind) {
    for (const auto& [text, mean] : result.metrics) {
      const MetricKey key = MetricKey::Parse(text);
      if (key.name != kind + ".mean" || !key.segment.empty()) continue;
      const std::string& subject = key.subject;
      const auto low = result.metrics.find(MetricKey{kind + ".low", subject, ""}.text());
      const auto high = result.metrics.find(MetricKey{kind + ".high", subject, ""}.text());
      if (low == result.metrics.end() || high == result.metrics.end()) continue;
      if (mean >= low->second && mean <= high->second) continue;
      result.events.push_back({kNoTimestamp, event,
                               "the mean " + name + " of " + subject_kind + subject + " is " +
                                   RoundedText(mean, 3) + ", outside the 95 % bounds [" +
                                   RoundedText(low->second, 3) + ", " +
                                   RoundedText(high->second, 3) + "]: the filter is " +
                                   (mean > high->second ? "overconfident" : "underconfident")});
    }
  };
  add_events(EventKind::kNeesBounds, "nees", "NEES", "");
  add_events(EventKind::kNisBounds, "nis", "NIS", "sensor ");
}

/// Adds an event `truth` if no frame contained a truth that the source declares.
void AddTruthEvent(const Metrics& metrics, EstimatorResult& result) {
  const std::vector<std::string> names = metrics.blocks_without_truth();
  if (names.empty()) return;
  result.events.push_back({kNoTimestamp, EventKind::kTruth,
                           "no frame contains the truth of " + Join(names) +
                               "; do the times of the truth match those of the measurements?"});
}

/// Adds an event `unused` for each sensor whose measurements the estimator never used during the
/// run.
void AddUnusedEvents(const Problem& problem, EstimatorResult& result) {
  for (const SensorBinding& sensor : problem.sensors) {
    std::int64_t used_count = 0, total = 0;
    std::vector<std::string> unused_counts;
    for (const auto& [text, count] : result.counts) {
      const MetricKey key = MetricKey::Parse(text);
      const std::string& outcome = key.name;
      if (key.subject != sensor.name || outcome == "inputs") continue;
      total += count;
      if (outcome == ToString(Outcome::kAccepted) || outcome == ToString(Outcome::kInitialised)) {
        used_count += count;
      } else {
        unused_counts.push_back(std::to_string(count) + ' ' + outcome);
      }
    }
    if (used_count > 0) continue;
    const std::string finding =
        total > 0
            ? ": the estimator used none of " + std::to_string(total) +
                  " measurements: " + Join(unused_counts, ", ")
            : ": stream '" + sensor.stream + "' had no measurement" +
                  (result.accepted_by.empty() ? "" : " that '" + result.accepted_by + "' accepted");
    result.events.push_back(
        {kNoTimestamp, EventKind::kUnused, "sensor '" + sensor.name + "'" + finding});
  }
}

}  // namespace

void Diagnose(const Experiment& experiment, EstimatorRun& run) {
  EstimatorResult& result = run.result;
  const Problem& problem = run.spec.problem;
  const Estimator& estimator = *run.spec.estimator;
  result.counts = run.metrics.counts();
  if (run.stale_inputs > 0) result.counts["input_stale"] = run.stale_inputs;
  result.units = run.metrics.units();
  const std::size_t event_count = result.events.size();
  AddMapMetrics(run.spec, *experiment.source, result);
  const bool is_known = run.has_estimate && !estimator.failed();
  if (is_known) AddUnusedEvents(problem, result);
  if (is_known && experiment.reference < 0) AddTruthEvent(run.metrics, result);
  AddUnitEvents(problem, run.metrics, result);
  if (is_known) AddConsistencyEvents(result);
  LogEvents(result.name, std::span(result.events).subspan(event_count));
  run.AddEvents(run.metrics.events());
  result.diverged = run.diverged || (estimator.offline() && estimator.diverged());
  result.inconsistent = !run.metrics.events().empty();
  result.failed = run.finished || run.diverged || estimator.failed() || estimator.diverged();
}

}  // namespace alidade::internal
