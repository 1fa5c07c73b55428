// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "alidade/record/images.h"

namespace alidade {

/// A writer of images of any kind: draws each frame, which a derived class writes or shows.
///
/// Of pixels (u, v) the image has on black a white disc of radius 4 px at each, placed to 1/256 px,
/// and the frame's number in dark grey at the lower left. The centre of the upper left pixel is
/// (0, 0).
class MatWriter : public ImageWriter {
 public:
  /// px, of the images that are drawn from points
  MatWriter(int width, int height) : width_(width), height_(height) {}

  void Add(std::int64_t number, Timestamp timestamp,
           const std::vector<std::array<double, 2>>& pixels) override;
  void Add(std::int64_t number, Timestamp timestamp, const GreyImage& image) override;
  void Add(const RunView& view) override;

 private:
  virtual void Write(std::int64_t number, Timestamp timestamp, const cv::Mat& image) = 0;

  int width_, height_;
};

}  // namespace alidade
