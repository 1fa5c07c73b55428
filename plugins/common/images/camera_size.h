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

/// The size that images must have: `camera.width` and `camera.height`, as the sensors on the
/// source's streams read them: of their own entry, of the config, or of the calibration that comes
/// with the images. Without such sensors: as one would.
class CameraSize {
 public:
  CameraSize() = default;
  CameraSize(const SourceArguments& arguments, const Source& source);

  /// Refuses an image of another size: all its pixels would be of another camera. Errors: kBadData.
  void Check(cv::Size found, const Place& image) const;

 private:
  struct Camera {
    std::optional<std::int64_t> width, height;  ///< none: not said
    std::string place;
  };

  static bool IsOf(const std::optional<std::int64_t>& side, int found);
  static std::string SideText(const std::optional<std::int64_t>& side);

  static std::vector<Node> SensorsOn(const std::vector<StreamInfo>& streams, const Node& root);

  /// Each number of the first of the maps that has it.
  void Read(const std::vector<Node>& maps);

  std::vector<Camera> cameras_;
};

}  // namespace alidade
