// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core.hpp>

#include "alidade/experiment/source.h"

namespace alidade {

/// Copies an 8-bit grey image.
inline GreyImage ToGreyImage(const cv::Mat& image) {
  GreyImage grey{image.cols, image.rows, {}};
  grey.pixels.reserve(image.total());
  for (int y = 0; y < image.rows; ++y) {
    const auto* row = image.ptr<unsigned char>(y);
    grey.pixels.insert(grey.pixels.end(), row, row + image.cols);
  }
  return grey;
}

}  // namespace alidade
