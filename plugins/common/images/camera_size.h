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

/// Size that the images must have: `camera.width` and `camera.height` of each sensor that reads a
/// stream of the source. Each key is read from the sensor's entry, else from the root of the
/// config, else from the calibration of the images. If no sensor reads a stream of the source, only
/// the root and the calibration are read.
class CameraSize {
 public:
  CameraSize() = default;
  CameraSize(const SourceArguments& arguments, const Source& source);

  /// Checks the size of an image. Error: kBadData if `found` is a different size, because the image
  /// is then from another camera.
  void Check(cv::Size found, const Place& image) const;

 private:
  struct Camera {
    std::optional<std::int64_t> width, height;  ///< empty if not specified
    std::string place;
  };

  static bool Matches(const std::optional<std::int64_t>& side, int found);
  static std::string SideText(const std::optional<std::int64_t>& side);

  static std::vector<Node> SensorsOn(const std::vector<StreamInfo>& streams, const Node& root);

  /// Reads the width and the height. Each key is read from the first map that contains it.
  void Read(const std::vector<Node>& maps);

  std::vector<Camera> cameras_;
};

}  // namespace alidade
