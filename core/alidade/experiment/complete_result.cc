// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/complete_result.h"

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

/// Adds an event `unit` for each role of a sensor whose unit differs from that of its block.
void AddRoleEvents(const Problem& problem, EstimatorResult& result) {
  for (const SensorBinding& sensor : problem.sensors) {
    for (std::size_t i = 0; i < sensor.roles.size(); ++i) {
      const BlockId block = sensor.roles[i].block;
      if (block < 0) continue;
      const Space& role = sensor.model->roles()[i];
      const std::string unit = UnitOf(problem, block);
      if (unit == role.unit || unit.empty() || role.unit.empty()) continue;
      result.events.push_back({kNoTimestamp, EventKind::kUnit,
                               "sensor '" + sensor.name + "': role '" + role.name +
                                   "' has the unit " + role.unit + ", but its block '" +
                                   problem.layout[block].name + "' has the unit " + unit +
                                   "; were two roles exchanged?"});
    }
  }
}

/// Adds an event `mostly_rejected` for each sensor with more rejected than used measurements.
void AddRejectionEvents(const std::vector<SensorUse>& sensors, EstimatorResult& result) {
  for (const SensorUse& use : sensors) {
    if (use.rejected <= use.used || use.used == 0)
      continue;  // `unused` reports a sensor without use
    result.events.push_back({kNoTimestamp, EventKind::kMostlyRejected,
                             "sensor '" + use.sensor + "': " + std::to_string(use.rejected) +
                                 " of " + std::to_string(use.used + use.rejected) +
                                 " measurements were rejected"});
  }
}

/// Adds an event `no_measurement` if the estimator used no measurement for a long time.
void AddGapEvent(const Metrics& metrics, EstimatorResult& result) {
  const auto gap = metrics.longest_gap();
  if (!gap) return;
  result.events.push_back({gap->start, EventKind::kNoMeasurement,
                           "no measurement was used for " + SecondsText(gap->end - gap->start) +
                               ", until " + SecondsText(gap->end)});
}

/// Adds the findings about the innovations, and the verdict.
void AddVerdict(const Metrics& metrics, std::string_view run_failure, EstimatorResult& result) {
  result.findings = Diagnose(metrics.innovations());
  const std::vector<NeesSeries> nees = metrics.nees();
  VerdictFacts facts{.failed = result.failed && !result.diverged,
                     .diverged = result.diverged,
                     .run_failure = run_failure,
                     .events = result.events,
                     .sensors = metrics.uses(),
                     .nees = nees,
                     .findings = result.findings};
  for (const InnovationSeries& series : metrics.innovations()) {
    facts.tested_sensors += IsScaleTested(series) ? 1 : 0;
  }
  result.verdict = ComputeVerdict(facts);
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

void CompleteResult(const Experiment& experiment, EstimatorRun& run, std::string_view run_failure) {
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
  if (is_known) AddRejectionEvents(run.metrics.uses(), result);
  if (is_known) AddGapEvent(run.metrics, result);
  if (is_known && experiment.reference < 0) AddTruthEvent(run.metrics, result);
  AddUnitEvents(problem, run.metrics, result);
  AddRoleEvents(problem, result);
  LogEvents(result.name, std::span(result.events).subspan(event_count));
  run.AddEvents(run.metrics.events());
  result.diverged = run.diverged || (estimator.offline() && estimator.diverged());
  result.failed = run.finished || run.diverged || estimator.failed() || estimator.diverged();
  AddVerdict(run.metrics, run_failure, result);
}

}  // namespace alidade::internal
