// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <GeographicLib/LocalCartesian.hpp>
#include <array>
#include <optional>

namespace alidade {

/// Position on the WGS 84 ellipsoid.
struct GeodeticPosition {
  double latitude_deg = 0.0;   ///< in [-90, 90]
  double longitude_deg = 0.0;  ///< in [-180, 180]
  double height_m = 0.0;       ///< above the ellipsoid
};

/// Local frame (east, north, up) that touches the WGS 84 ellipsoid below its origin.
class LocalFrame {
 public:
  /// If there is no `origin`, the first position that is converted becomes the origin.
  explicit LocalFrame(const std::optional<GeodeticPosition>& origin);

  /// Returns the coordinates of `position` in this frame: east, north and up, in m. Logs a warning
  /// if the first position is far from the origin.
  std::array<double, 3> FromGeodetic(const GeodeticPosition& position);

 private:
  std::optional<GeographicLib::LocalCartesian> frame_;
  bool has_position_ = false;  ///< true if a position was converted
};

}  // namespace alidade
