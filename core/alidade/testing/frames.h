// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "alidade/base/error.h"
#include "alidade/estimation/estimator.h"
#include "alidade/estimation/problem.h"

/// Helper functions for tests of filters, which create frames and read reports and states.
namespace alidade::testing {

/// Returns one stream for each sensor of the problem, in the order of the sensors.
inline std::vector<StreamInfo> StreamsOf(const Problem& problem) {
  std::vector<StreamInfo> streams;
  for (const SensorBinding& sensor : problem.sensors) {
    streams.push_back({sensor.stream, sensor.model->measurement().geometry.ambient, 0.0,
                       sensor.model->known_size()});
  }
  return streams;
}

/// Returns a frame with one scalar measurement for each pair (stream, value).
inline Frame FrameAt(double t_s, const std::vector<std::pair<int, double>>& values) {
  Frame frame;
  frame.timestamp = TimestampFromSeconds(t_s);
  for (const auto& [stream, value] : values) {
    frame.measurements.push_back({frame.timestamp, stream, -1, {value}, {}});
  }
  return frame;
}

/// Returns whether the report contains an event of this kind.
inline bool HasEvent(const UpdateReport& report, EventKind kind) {
  return std::ranges::count(report.events, kind, &Event::kind) > 0;
}

/// Returns the block with this name. ContractViolation if the name is unknown.
inline const Block& BlockOf(const State& state, std::string_view name) {
  const BlockId id = state.layout().Find(name);
  ALIDADE_EXPECTS(id >= 0);
  return state.layout()[id];
}

/// Returns the value of a scalar block. ContractViolation if the name is unknown.
inline double ValueOf(const State& state, std::string_view block) {
  return state.values()[static_cast<std::size_t>(BlockOf(state, block).value_offset)];
}

/// Returns the covariance of two scalar blocks. ContractViolation if a name is unknown.
inline double CovarianceOf(const State& state, std::string_view a, std::string_view b) {
  return state.covariance().Block(BlockOf(state, a).tangent_offset, 1,
                                  BlockOf(state, b).tangent_offset, 1)(0);
}

}  // namespace alidade::testing
