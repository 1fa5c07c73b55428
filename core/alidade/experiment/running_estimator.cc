// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/running_estimator.h"

#include <algorithm>
#include <iterator>

#include "alidade/base/number_text.h"
#include "alidade/base/words.h"
#include "alidade/estimation/observability.h"
#include "alidade/experiment/run_log.h"

namespace alidade::internal {

Frame WithoutFailed(const Running& one, const Frame& frame,
                    const std::vector<StreamInfo>& streams) {
  const System& system = one.named.system;
  const auto goes_on = [&](const Measurement& m) {
    const std::string& stream = streams[static_cast<std::size_t>(m.stream)].name;
    bool read = false, works = false;
    for (std::size_t s = 0; s < system.sensors.size(); ++s) {
      if (system.sensors[s].stream != stream) continue;
      read = true;
      works = works || one.failed_sensors[s] == 0;
    }
    return works || !read;  // a control input, say
  };
  Frame visible{frame.timestamp, {}};
  std::ranges::copy_if(frame.measurements, std::back_inserter(visible.measurements), goes_on);
  return visible;
}

std::string Running::TakeFailures(const UpdateReport& report) {
  if (named.on_plugin_failure == OnPluginFailure::kSkip) return {};
  for (const MeasurementReport& m : report.measurements()) {
    if (m.outcome != Outcome::kFailed) continue;
    const SensorBinding& sensor = named.system.sensors[static_cast<std::size_t>(m.sensor)];
    if (named.on_plugin_failure == OnPluginFailure::kAbort) {
      const std::string& plugin = sensor.model->description().origin;
      return "sensor '" + sensor.name + "', model '" + sensor.model->name() + "'" +
             (plugin.empty() ? "" : " of plugin " + plugin) +
             ", failed: " + sensor.model->error_text();
    }
    failed_sensors.resize(named.system.sensors.size(), 0);
    char& failed = failed_sensors[static_cast<std::size_t>(m.sensor)];
    if (failed == 0) {
      Note({{named.estimator->timestamp(), "sensor_disabled",
             "sensor '" + sensor.name + "' has failed; its stream '" + sensor.stream +
                 "' is no longer used, unless another sensor reads it"}});
    }
    failed = 1;
  }
  return {};
}

void Running::Take(std::size_t k, const Seen& seen, const State& state, const UpdateReport& report,
                   const RunOptions& options) {
  took = true;
  if (!waits) {
    metrics.Add(seen.frame, seen.in_segment, state, report);
  } else {
    metrics.AddReport(seen.in_segment, report);
    if (!report.stale) {
      estimates.push_back({k, ValuesOf(state, named.system.layout.blocks().size())});
    }
  }
  result.removed_landmarks.insert(result.removed_landmarks.end(), report.removed_landmarks.begin(),
                                  report.removed_landmarks.end());
  for (RunObserver* const observer : options.observers) {
    observer->OnEstimate(index, seen.frame, state, report);
  }
}

void Running::Note(const std::vector<Event>& events) {
  for (const Event& event : events) {
    const auto same = [&](const Event& one) {
      return one.kind == event.kind && one.text == event.text;
    };
    const bool stale = event.kind == "input_stale";
    if (stale) ++stale_inputs;
    if (stale && std::ranges::any_of(result.events, same)) continue;
    result.events.push_back(event);
    const bool ends = named.on_divergence == OnDivergence::kFail || ended;
    LogEvents(named.name, {&event, 1}, ends);
  }
}

EstimatorResult Begin(const NamedEstimator& named) {
  EstimatorResult result;
  result.name = named.name;
  result.unobservable = UnobservableDirections(named.system);
  if (!ObservabilityIsTold(named.system)) {
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

void NoteUnits(const System& system, const Metrics& metrics, EstimatorResult& result) {
  for (const int index : metrics.far_off()) {
    const SensorBinding& sensor = system.sensors[static_cast<std::size_t>(index)];
    const Space& measured = sensor.model->measurement();
    const bool angle = measured.geometry.kind == GeometryKind::kAngle;
    const std::string unit = measured.unit.empty() ? "the model's units" : measured.unit;
    result.events.push_back(
        {kNoTimestamp, "unit",
         "sensor '" + sensor.name + "': the median of |z - h| is more than " +
             (angle ? "5 sigma, and |z - h| > pi / 4 or |z| > 2 pi" : "100 sigma") +
             "; is stream '" + sensor.stream + "' in " + (angle ? "rad" : unit) + '?'});
  }
}

void NoteConsistency(EstimatorResult& result) {
  const auto note = [&](const std::string& kind, const std::string& name, const std::string& what) {
    const std::string prefix = kind + ".mean:";
    for (const auto& [key, mean] : result.metrics) {
      if (!key.starts_with(prefix)) continue;
      const std::string subject = key.substr(prefix.size());
      const auto low = result.metrics.find(kind + ".low:" + subject);
      const auto high = result.metrics.find(kind + ".high:" + subject);
      if (low == result.metrics.end() || high == result.metrics.end()) continue;
      if (mean >= low->second && mean <= high->second) continue;
      result.events.push_back({kNoTimestamp, kind + "_bounds",
                               name + " mean " + RoundedText(mean, 3) + " of " + what + subject +
                                   " is outside its 95 % bounds [" + RoundedText(low->second, 3) +
                                   ", " + RoundedText(high->second, 3) + "]: the filter is " +
                                   (mean > high->second ? "overconfident" : "underconfident")});
    }
  };
  note("nees", "NEES", "");
  note("nis", "NIS", "sensor ");
}

void NoteTruths(const Metrics& metrics, EstimatorResult& result) {
  const std::vector<std::string> names = metrics.without_truth();
  if (names.empty()) return;
  result.events.push_back(
      {kNoTimestamp, "truth",
       "no frame has the truth of " + Join(names) + "; are its times those of the measurements?"});
}

void NoteUnused(const System& system, const std::string& accepted_by, EstimatorResult& result) {
  for (const SensorBinding& sensor : system.sensors) {
    std::int64_t used = 0, all = 0;
    std::vector<std::string> others;
    for (const auto& [key, count] : result.counts) {
      const std::size_t colon = key.find(':');
      const std::string outcome = key.substr(0, colon);
      if (key.substr(colon + 1) != sensor.name || outcome == "inputs") continue;
      all += count;
      if (outcome == ToString(Outcome::kAccepted) || outcome == ToString(Outcome::kInitialised)) {
        used += count;
      } else {
        others.push_back(std::to_string(count) + ' ' + outcome);
      }
    }
    if (used > 0) continue;
    const std::string of_all =
        all > 0 ? " used none of " + std::to_string(all) + " measurements: " + Join(others, ", ")
                : ": stream '" + sensor.stream + "' had no measurement" +
                      (accepted_by.empty() ? "" : " that " + accepted_by + " accepted");
    result.events.push_back({kNoTimestamp, "unused", "sensor '" + sensor.name + "'" + of_all});
  }
}

}  // namespace alidade::internal
