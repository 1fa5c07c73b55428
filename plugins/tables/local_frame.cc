// SPDX-License-Identifier: Apache-2.0
#include "local_frame.h"

namespace alidade {
namespace {

GeographicLib::LocalCartesian FrameAt(const GeodeticPosition& origin) {
  return {origin.latitude_deg, origin.longitude_deg, origin.height_m};
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
  return enu;
}

}  // namespace alidade
