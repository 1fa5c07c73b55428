// SPDX-License-Identifier: Apache-2.0
#include "alidade/run/accepted_data.h"

#include <algorithm>
#include <optional>

#include "alidade/base/words.h"

namespace alidade::internal {
namespace {

/// Whether each measurement of a sensor was used, in the order of the frame, as the report is.
std::vector<bool> UsedOf(int sensor, const UpdateReport& report) {
  std::vector<bool> used;
  for (const MeasurementReport& entry : report.measurements()) {
    if (entry.sensor != sensor) continue;
    used.push_back(entry.outcome == Outcome::kAccepted || entry.outcome == Outcome::kInitialised);
  }
  return used;
}

/// Refuses `filter` where what it accepted does not tell what `named` is to see.
void CheckAccepts(const NamedEstimator& filter, const NamedEstimator& named, const Node& by) {
  const std::string quoted = '\'' + filter.name + '\'';
  if (filter.estimator->offline()) {
    by.Fail(quoted + " has its estimates at the end only", "a filter");
  }
  for (const SensorBinding& sensor : named.system.sensors) {
    const int index = filter.system.FindSensor(sensor.name);
    const auto& theirs = filter.system.sensors;
    if (index < 0 || theirs[static_cast<std::size_t>(index)].stream != sensor.stream) {
      by.Fail(
          quoted + " does not use sensor '" + sensor.name + "' on stream '" + sensor.stream + "'",
          "an estimator with the same sensors");
    }
    if (std::ranges::count(theirs, sensor.stream, &SensorBinding::stream) > 1) {
      by.Fail("stream '" + sensor.stream + "' goes to several sensors of " + quoted +
                  ": one may accept what another does not",
              "a stream for each sensor");
    }
  }
}

/// Refuses a control input of `named` that is a measurement of `filter`, which may not accept it.
void CheckInputs(const NamedEstimator& filter, const NamedEstimator& named, const Node& by) {
  for (const MotionBinding& motion : named.system.motions) {
    const std::string& stream = motion.input.stream;
    const auto& theirs = filter.system.sensors;
    const auto sensor = std::ranges::find(theirs, stream, &SensorBinding::stream);
    if (!motion.model.has_input() || sensor == theirs.end()) continue;
    by.Fail("stream '" + stream + "' is the control input of '" + motion.name +
                "' and goes to sensor '" + sensor->name + "' of '" + filter.name +
                "': what that does not accept would be missing as an input",
            "a filter without a sensor on that stream");
  }
}

}  // namespace

int ReadUse(const Node& use, const NamedEstimator& named, const Node& estimators,
            const std::vector<NamedEstimator>& before) {
  if (!use.is_map()) {
    if (use.Text() == "all") return -1;
    use.Fail("not a choice of data: '" + use.Text() + "'", "all, or {accepted_by: NAME}");
  }
  const Node by = use.At("accepted_by", "use");
  const std::string name = by.Text();
  if (name == named.name) by.Fail("'" + name + "' is this estimator itself", "another one");
  const auto found = std::ranges::find(before, name, &NamedEstimator::name);
  if (found == before.end()) {
    std::vector<std::string> known;
    for (const auto& [other, entry] : estimators.Entries()) known.push_back(other);
    if (std::ranges::find(known, name) != known.end()) {
      by.Fail("'" + name + "' is listed after '" + named.name + "'",
              "an estimator listed before, which has each frame first");
    }
    std::erase(known, named.name);
    by.Fail("no estimator '" + name + "'", "a name from `estimators`", Nearest(name, known));
  }
  CheckAccepts(*found, named, by);
  const int first = static_cast<int>(found - before.begin());
  for (int i = first; i >= 0; i = before[static_cast<std::size_t>(i)].accepted_by) {
    CheckInputs(before[static_cast<std::size_t>(i)], named, by);
  }
  return first;
}

Frame AcceptedOf(const Frame& frame, const std::vector<StreamInfo>& streams, const System& system,
                 const UpdateReport& report) {
  Frame accepted{frame.stamp, {}, frame.truth};
  std::vector<std::optional<std::vector<bool>>> used(streams.size());  // none: of no sensor
  for (int sensor = 0; sensor < std::ssize(system.sensors); ++sensor) {
    const std::string& stream = system.sensors[static_cast<std::size_t>(sensor)].stream;
    const auto found = std::ranges::find(streams, stream, &StreamInfo::name);
    ALIDADE_EXPECTS(found != streams.end());
    used[static_cast<std::size_t>(found - streams.begin())] = UsedOf(sensor, report);
  }
  std::vector<std::size_t> next(streams.size(), 0);
  for (const Measurement& m : frame.measurements) {
    const auto stream = static_cast<std::size_t>(m.stream);
    const std::size_t at = next[stream]++;
    const bool is_used = !used[stream] || (at < used[stream]->size() && (*used[stream])[at]);
    if (is_used) accepted.measurements.push_back(m);
  }
  return accepted;
}

}  // namespace alidade::internal
