// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "alidade/record/images.h"

namespace alidade {

/// Image writer that draws each frame. A derived class writes or shows the image.
///
/// Points (u, v) are drawn on a black background, as white discs of radius 4 px. Their positions
/// are rounded to 1/256 px. The number of the frame is drawn at the lower left, in dark grey. The
/// centre of the upper left pixel has u = v = 0.
class MatWriter : public ImageWriter {
 public:
  /// `width` and `height` are the size, px, of the images that are drawn from points.
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
