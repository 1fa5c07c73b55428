// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "alidade/base/error.h"
#include "alidade/base/number_text.h"
#include "alidade/evaluate/evaluate.h"

namespace alidade {
namespace {

[[noreturn]] void Fail(const Trajectory& trajectory, const std::string& problem,
                       const std::string& expected) {
  throw Error(ExitCode::kBadData,
              ErrorLine({trajectory.name}, "--t-start, --t-end", problem, expected));
}

}  // namespace

bool TimeRange::Contains(Timestamp timestamp) const {
  return (!start || timestamp >= *start) && (!end || timestamp <= *end);
}

Trajectory Crop(const Trajectory& trajectory, const TimeRange& range) {
  if (range.is_unlimited()) return trajectory;
  if (!trajectory.has_timestamps()) Fail(trajectory, "the poses have no timestamps", "timestamps");
  std::vector<int> inside;
  for (int i = 0; i < trajectory.size(); ++i) {
    if (range.Contains(trajectory.timestamps[static_cast<std::size_t>(i)])) inside.push_back(i);
  }
  if (!inside.empty()) return trajectory.Select(inside);
  Fail(trajectory, "no pose is in this range of time",
       "a part of " + internal::SecondsText(trajectory.timestamps.front()) + " to " +
           internal::SecondsText(trajectory.timestamps.back()));
}

Trajectory Downsample(const Trajectory& trajectory, int poses) {
  ALIDADE_EXPECTS(poses >= 0);
  if (poses == 0 || trajectory.size() <= poses) return trajectory;
  std::vector<int> indices(static_cast<std::size_t>(poses), 0);
  const int last = trajectory.size() - 1;
  const double step = poses == 1 ? 0.0 : static_cast<double>(last) / (poses - 1);
  for (int k = 0; k < poses; ++k) {
    indices[static_cast<std::size_t>(k)] = static_cast<int>(std::floor(step * k));
  }
  if (poses > 1) indices.back() = last;  // whatever the rounding of `step`
  return trajectory.Select(indices);
}

}  // namespace alidade
