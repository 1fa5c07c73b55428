// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "alidade/estimation/problem.h"

namespace alidade::internal {

/// Innovations r = z (-) h of the accepted measurements of one sensor in one frame.
struct FrameInnovation {
  std::int64_t measurements = 0;
  double rms = std::numeric_limits<double>::quiet_NaN();  ///< sqrt(mean r_i^2) over all elements
};

/// Summarises the innovations of a sensor in the frame of `report`. `sensor` is the index of the
/// sensor.
inline FrameInnovation FrameInnovationOf(const UpdateReport& report, int sensor) {
  FrameInnovation frame;
  double sum = 0.0, count = 0.0;
  for (const MeasurementReport& m : report.measurements()) {
    if (m.sensor != sensor || m.outcome != Outcome::kAccepted || m.innovation.empty()) continue;
    for (const double r : m.innovation) sum += r * r;
    count += static_cast<double>(m.innovation.size());
    ++frame.measurements;
  }
  if (count > 0.0) frame.rms = std::sqrt(sum / count);
  return frame;
}

/// Returns whether the rms of a frame is a reprojection error. This is the case if the sensor
/// measures landmarks, and all elements of a measurement have the same unit.
inline bool HasReprojection(const SensorBinding& binding) {
  return binding.model->has_landmark() && !binding.model->measurement().unit.empty();
}

}  // namespace alidade::internal
