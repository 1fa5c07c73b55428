// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/estimator_run.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>
#include <numbers>

#include "alidade/base/number_text.h"
#include "alidade/base/text.h"
#include "alidade/estimation/observability.h"
#include "alidade/experiment/run_log.h"

namespace alidade::internal {
namespace {

/// Returns the frame without the streams that only failed sensors read. `failed` has an element for
/// each sensor.
Frame WithoutFailedStreams(const Frame& frame, const std::vector<StreamInfo>& streams,
                           const Problem& problem, const std::vector<char>& failed) {
  const auto is_visible = [&](const Measurement& m) {
    const std::string& stream = streams[static_cast<std::size_t>(m.stream)].name;
    bool is_read = false, has_working_sensor = false;
    for (std::size_t s = 0; s < problem.sensors.size(); ++s) {
      if (problem.sensors[s].stream != stream) continue;
      is_read = true;
      has_working_sensor = has_working_sensor || failed[s] == 0;
    }
    return has_working_sensor || !is_read;  // an unread stream may be a control input
  };
  Frame visible{frame.timestamp, {}};
  std::ranges::copy_if(frame.measurements, std::back_inserter(visible.measurements), is_visible);
  return visible;
}

}  // namespace

EstimatorRun::FrameResult EstimatorRun::Process(const Frame& frame,
                                                const std::vector<StreamInfo>& streams,
                                                const ProcessedFrame* rolled_back) const {
  if (rolled_back != nullptr) return {*rolled_back->snapshot, rolled_back->report, {}};
  Frame visible;
  const bool sees_all = failed_sensors.empty();
  if (!sees_all) visible = WithoutFailedStreams(frame, streams, spec.problem, failed_sensors);
  const auto started = std::chrono::steady_clock::now();
  const UpdateReport& report = spec.estimator->Process(sees_all ? frame : visible);
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - started;
  return {*spec.estimator, report, elapsed.count()};
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
    char& has_failed = failed_sensors[static_cast<std::size_t>(m.sensor)];
    if (has_failed == 0) {
      AddEvents({{spec.estimator->timestamp(), EventKind::kSensorDisabled,
                  "sensor '" + sensor.name + "' has failed; its stream '" + sensor.stream +
                      "' is ignored from now on, unless another sensor reads this stream"}});
    }
    has_failed = 1;
  }
  return {};
}

void EstimatorRun::AddEstimate(std::size_t k, const FrameWithSegments& frame, const State& state,
                               const UpdateReport& report, const RunOptions& options) {
  has_estimate = true;
  measurement_log.Add(frame.frame.timestamp, report);
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
    const auto is_equal = [&](const Event& earlier) {
      return earlier.kind == event.kind && earlier.text == event.text;
    };
    const bool is_stale = event.kind == EventKind::kInputStale;
    if (is_stale) ++stale_inputs;
    if (is_stale && std::ranges::any_of(result.events, is_equal)) continue;
    result.events.push_back(event);
    const bool ends_run = spec.on_divergence == OnDivergence::kFail || finished;
    LogEvents(spec.name, {&event, 1}, ends_run);
  }
}

namespace {

/// Returns an event `unit` for each angle whose prior may be in degrees: whose mean or sigma is
/// larger than a revolution.
std::vector<Event> AngleEvents(const Problem& problem) {
  constexpr double kRevolution = 2.0 * std::numbers::pi;
  std::vector<Event> events;
  for (const Prior& prior : problem.priors) {
    const Block& block = problem.layout[prior.block];
    if (!block.geometry().is_angle() || prior.mean.empty()) continue;
    const double sigma = prior.covariance.size() > 0 ? std::sqrt(prior.covariance(0, 0)) : 0.0;
    if (std::abs(prior.mean[0]) <= kRevolution && sigma <= kRevolution) continue;
    events.push_back({kNoTimestamp, EventKind::kUnit,
                      "the initial value of angle '" + block.name + "' is " +
                          RoundedText(prior.mean[0]) + " rad +- " + RoundedText(sigma) +
                          " rad, more than a revolution; is it in deg?"});
  }
  return events;
}

/// Returns the result of an estimator before the first frame.
EstimatorResult InitialResult(const EstimatorSpec& spec, const Experiment& experiment) {
  EstimatorResult result;
  result.name = spec.name;
  result.type = spec.type;
  result.kind = spec.kind;
  result.smoothed = spec.estimator->offline();
  if (spec.accepted_by >= 0) {
    result.accepted_by = experiment.estimators[static_cast<std::size_t>(spec.accepted_by)].name;
  }
  result.overrides = spec.overrides;
  result.expects_poor = spec.expects_poor;
  result.sensors = NamesOf(spec.problem.sensors);
  const BlockId position = PositionBlockOf(spec.problem);
  if (position >= 0) result.position_block = spec.problem.layout[position].name;
  result.events = AngleEvents(spec.problem);
  result.unobservable = UnobservableDirections(spec.problem);
  if (!IsObservabilityComputed(spec.problem)) {
    result.events.push_back({kNoTimestamp, EventKind::kObservability,
                             "observability is not analysed: the state has more than " +
                                 std::to_string(kMaxObservabilityElements) + " elements"});
  }
  for (const auto& direction : result.unobservable) {
    result.events.push_back({kNoTimestamp, EventKind::kUnobservable,
                             "no sensor of this estimator determines " + Join(direction, " and ") +
                                 (direction.size() > 1 ? " separately" : "")});
  }
  return result;
}

}  // namespace

std::vector<EstimatorRun> CreateRuns(Experiment& experiment) {
  const int reference = experiment.reference;
  std::vector<StreamInfo> truths = experiment.source->truths();
  for (std::size_t t = 0; t < experiment.truth_sigmas.size(); ++t)
    truths.at(t).sigma = experiment.truth_sigmas[t];
  if (reference >= 0) {
    truths = BlocksOf(experiment.estimators[static_cast<std::size_t>(reference)].problem);
  }
  std::vector<EstimatorRun> runs;
  for (EstimatorSpec& spec : experiment.estimators) {
    const int index = static_cast<int>(runs.size());
    Metrics metrics(spec, index == reference ? std::vector<StreamInfo>() : truths,
                    experiment.segments);
    runs.push_back({spec, index, std::move(metrics), MeasurementLog(spec.problem),
                    InitialResult(spec, experiment)});
    runs.back().needs_reference = reference >= 0;
  }
  return runs;
}

}  // namespace alidade::internal
