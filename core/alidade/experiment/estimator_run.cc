// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/estimator_run.h"

#include <algorithm>
#include <chrono>
#include <iterator>

#include "alidade/base/number_text.h"
#include "alidade/base/text.h"
#include "alidade/estimation/observability.h"
#include "alidade/experiment/run_log.h"

namespace alidade::internal {
namespace {

/// The frame without the streams that only failed sensors read; `failed` by sensor.
Frame WithoutFailed(const Frame& frame, const std::vector<StreamInfo>& streams,
                    const Problem& problem, const std::vector<char>& failed) {
  const auto goes_on = [&](const Measurement& m) {
    const std::string& stream = streams[static_cast<std::size_t>(m.stream)].name;
    bool read = false, works = false;
    for (std::size_t s = 0; s < problem.sensors.size(); ++s) {
      if (problem.sensors[s].stream != stream) continue;
      read = true;
      works = works || failed[s] == 0;
    }
    return works || !read;  // a control input, say
  };
  Frame visible{frame.timestamp, {}};
  std::ranges::copy_if(frame.measurements, std::back_inserter(visible.measurements), goes_on);
  return visible;
}

}  // namespace

EstimatorRun::AfterFrame EstimatorRun::Process(const Frame& frame,
                                               const std::vector<StreamInfo>& streams,
                                               const ProcessedFrame* rolled_back) const {
  if (rolled_back != nullptr) return {*rolled_back->after, rolled_back->report, {}};
  Frame visible;
  const bool all = failed_sensors.empty();
  if (!all) visible = WithoutFailed(frame, streams, spec.problem, failed_sensors);
  const auto started = std::chrono::steady_clock::now();
  const UpdateReport& report = spec.estimator->Process(all ? frame : visible);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - started;
  return {*spec.estimator, report, took.count()};
}

std::string EstimatorRun::HandleFailures(const UpdateReport& report) {
  if (spec.on_plugin_failure == OnPluginFailure::kSkip) return {};
  for (const MeasurementReport& m : report.measurements()) {
    if (m.outcome != Outcome::kFailed) continue;
    const SensorBinding& sensor = spec.problem.sensors[static_cast<std::size_t>(m.sensor)];
    if (spec.on_plugin_failure == OnPluginFailure::kAbort) {
      const std::string& plugin = sensor.model->description().origin;
      return "sensor '" + sensor.name + "', model '" + sensor.model->name() + "'" +
             (plugin.empty() ? "" : " of plugin " + plugin) +
             ", failed: " + sensor.model->error_text();
    }
    failed_sensors.resize(spec.problem.sensors.size(), 0);
    char& failed = failed_sensors[static_cast<std::size_t>(m.sensor)];
    if (failed == 0) {
      AddEvents({{spec.estimator->timestamp(), "sensor_disabled",
                  "sensor '" + sensor.name + "' has failed; its stream '" + sensor.stream +
                      "' is no longer used, unless another sensor reads it"}});
    }
    failed = 1;
  }
  return {};
}

void EstimatorRun::AddEstimate(std::size_t k, const FrameWithSegments& frame, const State& state,
                               const UpdateReport& report, const RunOptions& options) {
  has_estimate = true;
  if (!needs_reference) {
    metrics.Add(frame.frame, frame.in_segment, state, report);
  } else {
    metrics.AddReport(frame.in_segment, report);
    if (!report.stale) {
      estimates.push_back({k, ValuesOf(state, spec.problem.layout.blocks().size())});
    }
  }
  result.removed_landmarks.insert(result.removed_landmarks.end(), report.removed_landmarks.begin(),
                                  report.removed_landmarks.end());
  for (RunObserver* const observer : options.observers) {
    observer->OnEstimate(index, frame.frame, state, report);
  }
}

void EstimatorRun::AddEvents(const std::vector<Event>& events) {
  for (const Event& event : events) {
    const auto same = [&](const Event& one) {
      return one.kind == event.kind && one.text == event.text;
    };
    const bool stale = event.kind == "input_stale";
    if (stale) ++stale_inputs;
    if (stale && std::ranges::any_of(result.events, same)) continue;
    result.events.push_back(event);
    const bool ends = spec.on_divergence == OnDivergence::kFail || finished;
    LogEvents(spec.name, {&event, 1}, ends);
  }
}

namespace {

/// The result before the first frame.
EstimatorResult ResultOf(const EstimatorSpec& spec, const Experiment& experiment) {
  EstimatorResult result;
  result.name = spec.name;
  result.type = spec.type;
  result.kind = spec.kind;
  result.smoothed = spec.estimator->offline();
  if (spec.accepted_by >= 0) {
    result.accepted_by = experiment.estimators[static_cast<std::size_t>(spec.accepted_by)].name;
  }
  result.overrides = spec.overrides;
  result.sensors = NamesOf(spec.problem.sensors);
  const BlockId position = PositionBlockOf(spec.problem);
  if (position >= 0) result.position_block = spec.problem.layout[position].name;
  result.unobservable = UnobservableDirections(spec.problem);
  if (!ObservabilityIsTold(spec.problem)) {
    result.events.push_back({kNoTimestamp, "observability",
                             "not looked into: the state has more than " +
                                 std::to_string(kMostObserved) + " elements"});
  }
  for (const auto& direction : result.unobservable) {
    result.events.push_back({kNoTimestamp, "unobservable",
                             "no sensor of this estimator determines " + Join(direction, " and ") +
                                 (direction.size() > 1 ? " apart" : "")});
  }
  return result;
}

}  // namespace

std::vector<EstimatorRun> BeginAll(Experiment& experiment) {
  const int reference = experiment.reference;
  std::vector<StreamInfo> truths = experiment.source->truths();
  for (std::size_t t = 0; t < experiment.truth_sigmas.size(); ++t)
    truths.at(t).sigma = experiment.truth_sigmas[t];
  if (reference >= 0) {
    truths = BlocksOf(experiment.estimators[static_cast<std::size_t>(reference)].problem);
  }
  std::vector<EstimatorRun> running;
  for (EstimatorSpec& spec : experiment.estimators) {
    const int index = static_cast<int>(running.size());
    Metrics metrics(spec, index == reference ? std::vector<StreamInfo>() : truths,
                    experiment.segments);
    running.push_back({spec, index, std::move(metrics), ResultOf(spec, experiment)});
    running.back().needs_reference = reference >= 0;
  }
  return running;
}

}  // namespace alidade::internal
