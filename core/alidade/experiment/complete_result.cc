// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/complete_result.h"

#include <cmath>
#include <numbers>
#include <span>

#include "alidade/base/number_text.h"
#include "alidade/base/text.h"
#include "alidade/experiment/map_metrics.h"
#include "alidade/experiment/metric_key.h"
#include "alidade/experiment/run_log.h"

namespace alidade::internal {
namespace {

/// Returns whether the measurements of a sensor may have the wrong unit: more than half of the
/// accepted and gated ones are far from their predictions. A measurement is far from its prediction
/// if sqrt(r' S^-1 r / dof) > 100. For an angle, r never exceeds pi. An angle is far if
/// |r| > 5 sqrt(S), and also |r| > pi / 4 or |z| > 2 pi.
bool MayHaveWrongUnit(const InnovationSeries& series, bool is_angle) {
  constexpr double kFarSigmas = 100.0, kFarAngleSigmas = 5.0, kPi = std::numbers::pi;
  std::size_t far_count = 0;
  for (std::size_t i = 0; i < series.size(); ++i) {
    const bool is_far_angle =
        is_angle && series.nis[i] > kFarAngleSigmas * kFarAngleSigmas &&
        (std::abs(series.innovation[i]) > 0.25 * kPi || std::abs(series.z[i]) > 2.0 * kPi);
    far_count += is_far_angle || series.nis[i] > kFarSigmas * kFarSigmas * series.dof;
  }
  return 2 * far_count > series.size();
}

/// Adds an event `unit` for each sensor whose measurements may have the wrong unit.
void AddUnitEvents(const Problem& problem, const std::vector<InnovationSeries>& innovations,
                   EstimatorResult& result) {
  for (std::size_t i = 0; i < problem.sensors.size(); ++i) {
    const SensorBinding& sensor = problem.sensors[i];
    const Space& measured = sensor.model->measurement();
    const bool is_angle = measured.geometry.is_angle();
    if (!MayHaveWrongUnit(innovations[i], is_angle)) continue;
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

/// Adds an event `mostly_rejected` for each sensor with more rejected than used measurements. Event
/// `unused` reports a sensor without a used measurement.
void AddRejectionEvents(const std::vector<SensorUse>& sensors, EstimatorResult& result) {
  for (const SensorUse& use : sensors) {
    if (use.rejected <= use.used || use.used == 0) continue;
    result.events.push_back({kNoTimestamp, EventKind::kMostlyRejected, use.RejectionText()});
  }
}

/// Adds an event `no_measurement` if the estimator used no measurement for a long time, or else for
/// each sensor that has no measurement at the end of the run.
void AddGapEvents(const MeasurementLog& log, EstimatorResult& result) {
  const auto add = [&](const MeasurementLog::Gap& gap, const std::string& subject) {
    result.events.push_back(
        {gap.start, EventKind::kNoMeasurement,
         subject + " for " + SecondsText(gap.end - gap.start) + ", until " + SecondsText(gap.end)});
  };
  if (const auto gap = log.longest_gap()) return add(*gap, "no measurement was used");
  for (std::size_t i = 0; i < log.uses().size(); ++i) {
    const auto gap = log.FinalGap(i);
    if (gap) add(*gap, "sensor '" + log.uses()[i].sensor + "' had no measurement");
  }
}

/// Adds the findings about the innovations, and the verdict.
void AddVerdict(const MeasurementLog& log, const std::vector<NeesSeries>& nees,
                std::string_view run_failure, EstimatorResult& result) {
  result.findings = Diagnose(log.innovations());
  VerdictFacts facts{.failed = result.failed && !result.diverged,
                     .diverged = result.diverged,
                     .run_failure = run_failure,
                     .events = result.events,
                     .sensors = log.uses(),
                     .nees = nees,
                     .findings = result.findings};
  for (const InnovationSeries& series : log.innovations()) {
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
      if (std::ranges::any_of(kOutcomes, [&](const OutcomeInfo& info) {
            return info.is_used && info.name == outcome;
          })) {
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
  if (is_known) AddRejectionEvents(run.measurement_log.uses(), result);
  if (is_known) AddGapEvents(run.measurement_log, result);
  if (is_known && experiment.reference < 0) AddTruthEvent(run.metrics, result);
  AddUnitEvents(problem, run.measurement_log.innovations(), result);
  AddRoleEvents(problem, result);
  LogEvents(result.name, std::span(result.events).subspan(event_count));
  run.AddEvents(run.metrics.events());
  result.diverged = run.diverged || (estimator.offline() && estimator.diverged());
  result.failed = run.finished || run.diverged || estimator.failed() || estimator.diverged();
  AddVerdict(run.measurement_log, run.metrics.nees(), run_failure, result);
}

}  // namespace alidade::internal
