// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <utility>
#include <vector>

#include "alidade/record/images.h"
#include "draw_run_view.h"

namespace alidade {

/// The image of one frame: on black a white disc of radius 4 px at each of the pixels (u, v),
/// placed to 1/256 px, and the frame's number in dark grey at the lower left. The centre of the
/// upper left pixel is (0, 0).
inline cv::Mat Draw(std::int64_t number, const std::vector<std::array<double, 2>>& pixels,
                    int width, int height) {
  constexpr int kShift = 8, kRadius = 4;  // bits behind the point; px
  constexpr double kOne = 1 << kShift, kMargin = kRadius + 1.0;
  const cv::Scalar white(255, 255, 255), grey(50, 50, 50);
  cv::Mat image(height, width, CV_8UC3, cv::Scalar());
  cv::putText(image, std::to_string(number), {4, height - 5}, cv::FONT_HERSHEY_PLAIN, 1.0, grey);
  for (const auto& [u, v] : pixels) {
    const bool seen = u > -kMargin && u < width + kMargin && v > -kMargin && v < height + kMargin;
    if (!seen) continue;
    const cv::Point centre(cvRound(u * kOne), cvRound(v * kOne));
    cv::circle(image, centre, kRadius << kShift, white, cv::FILLED, cv::LINE_AA, kShift);
  }
  return image;
}

/// A writer of images of any kind.
class MatWriter : public ImageWriter {
 public:
  explicit MatWriter(ImageArguments arguments) : to_(std::move(arguments)) {}

  void Add(std::int64_t number, Timestamp timestamp,
           const std::vector<std::array<double, 2>>& pixels) override {
    Write(number, timestamp, Draw(number, pixels, to_.width, to_.height));
  }
  void Add(std::int64_t number, Timestamp timestamp, const GreyImage& image) override {
    cv::Mat grey(image.height, image.width, CV_8UC1);
    std::ranges::copy(image.pixels, grey.begin<unsigned char>());
    Write(number, timestamp, grey);
  }
  void Add(const RunView& view) override {
    Write(view.number, view.timestamp, draw::DrawRunView(view));
  }

 protected:
  virtual void Write(std::int64_t number, Timestamp timestamp, const cv::Mat& image) = 0;
  const ImageArguments& to() const { return to_; }

 private:
  ImageArguments to_;
};

}  // namespace alidade
