// SPDX-License-Identifier: Apache-2.0
#include "local_frame.h"

#include <cmath>
#include <string>
#include <utility>

#include "alidade/io/log.h"

namespace alidade {
namespace {

GeographicLib::LocalCartesian FrameAt(const GeodeticPosition& origin) {
  return {origin.latitude_deg, origin.longitude_deg, origin.height_m};
}

void WarnIfFar(double distance_m) {
  constexpr double kFar = 100e3, kKilometre = 1e3;
  if (distance_m <= kFar) return;
  Log(LogLevel::kWarning, "the first geodetic position is " +
                              std::to_string(std::llround(distance_m / kKilometre)) +
                              " km from `origin`; are latitude and longitude exchanged, in the "
                              "columns or in `origin`?");
}

}  // namespace

LocalFrame::LocalFrame(const std::optional<GeodeticPosition>& origin) {
  if (origin) frame_ = FrameAt(*origin);
}

std::array<double, 3> LocalFrame::FromGeodetic(const GeodeticPosition& position) {
  if (!frame_) frame_ = FrameAt(position);
  std::array<double, 3> enu{};
  frame_->Forward(position.latitude_deg, position.longitude_deg, position.height_m, enu[0], enu[1],
                  enu[2]);
  if (!std::exchange(has_position_, true)) WarnIfFar(std::hypot(enu[0], enu[1], enu[2]));
  return enu;
}

}  // namespace alidade
