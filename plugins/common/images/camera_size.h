// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "alidade/config/config.h"
#include "alidade/experiment/source.h"

namespace alidade {

std::string SizeText(cv::Size size);

/// Size that the images must have: `camera.width` and `camera.height`, as the sensors of the
/// source's streams read them. They are in the sensor's entry, the config, or the calibration that
/// comes with the images. Without such a sensor only the last two are read.
class CameraSize {
 public:
  CameraSize() = default;
  CameraSize(const SourceArguments& arguments, const Source& source);

  /// Rejects an image of another size, because its pixels belong to another camera. Errors:
  /// kBadData.
  void Check(cv::Size found, const Place& image) const;

 private:
  struct Camera {
    std::optional<std::int64_t> width, height;  ///< empty if not specified
    std::string place;
  };

  static bool Matches(const std::optional<std::int64_t>& side, int found);
  static std::string SideText(const std::optional<std::int64_t>& side);

  static std::vector<Node> SensorsOn(const std::vector<StreamInfo>& streams, const Node& root);

  /// Reads each side from the first of the maps that contains it.
  void Read(const std::vector<Node>& maps);

  std::vector<Camera> cameras_;
};

}  // namespace alidade
