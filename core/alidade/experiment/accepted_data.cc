// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/accepted_data.h"

#include <algorithm>
#include <optional>

namespace alidade::internal {
namespace {

/// Returns whether the estimator used each measurement of a sensor. The measurements have the same
/// order in the result, the frame and the report.
std::vector<bool> UsedMeasurements(int sensor, const UpdateReport& report) {
  std::vector<bool> used;
  for (const MeasurementReport& entry : report.measurements()) {
    if (entry.sensor != sensor) continue;
    used.push_back(InfoOf(entry.outcome).is_used);
  }
  return used;
}

}  // namespace

Frame AcceptedMeasurements(const Frame& frame, const std::vector<StreamInfo>& streams,
                           const Problem& problem, const UpdateReport& report) {
  Frame accepted{frame.timestamp, {}};
  // An element is nullopt if no sensor reads the stream.
  std::vector<std::optional<std::vector<bool>>> used(streams.size());
  for (int sensor = 0; sensor < std::ssize(problem.sensors); ++sensor) {
    const std::string& stream = problem.sensors[static_cast<std::size_t>(sensor)].stream;
    const auto found = std::ranges::find(streams, stream, &StreamInfo::name);
    ALIDADE_EXPECTS(found != streams.end());
    used[static_cast<std::size_t>(found - streams.begin())] = UsedMeasurements(sensor, report);
  }
  std::vector<std::size_t> next(streams.size(), 0);
  for (const Measurement& m : frame.measurements) {
    const auto stream = static_cast<std::size_t>(m.stream);
    const std::size_t index = next[stream]++;
    const bool is_used = !used[stream] || (index < used[stream]->size() && (*used[stream])[index]);
    if (is_used) accepted.measurements.push_back(m);
  }
  return accepted;
}

}  // namespace alidade::internal
