// SPDX-License-Identifier: Apache-2.0
#include "mat_writer.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <string>

#include "draw_run_view.h"

namespace alidade {
namespace {

cv::Mat Draw(std::int64_t number, const std::vector<std::array<double, 2>>& pixels, int width,
             int height) {
  constexpr int kShift = 8, kRadius = 4;  // fractional bits; px
  constexpr double kOne = 1 << kShift, kMargin = kRadius + 1.0;
  const cv::Scalar white(255, 255, 255), grey(50, 50, 50);
  cv::Mat image(height, width, CV_8UC3, cv::Scalar());
  cv::putText(image, std::to_string(number), {4, height - 5}, cv::FONT_HERSHEY_PLAIN, 1.0, grey);
  for (const auto& [u, v] : pixels) {
    const bool is_visible =
        u > -kMargin && u < width + kMargin && v > -kMargin && v < height + kMargin;
    if (!is_visible) continue;
    const cv::Point centre(cvRound(u * kOne), cvRound(v * kOne));
    cv::circle(image, centre, kRadius << kShift, white, cv::FILLED, cv::LINE_AA, kShift);
  }
  return image;
}

}  // namespace

void MatWriter::Add(std::int64_t number, Timestamp timestamp,
                    const std::vector<std::array<double, 2>>& pixels) {
  Write(number, timestamp, Draw(number, pixels, width_, height_));
}

void MatWriter::Add(std::int64_t number, Timestamp timestamp, const GreyImage& image) {
  cv::Mat grey(image.height, image.width, CV_8UC1);
  std::ranges::copy(image.pixels, grey.begin<unsigned char>());
  Write(number, timestamp, grey);
}

void MatWriter::Add(const RunView& view) {
  Write(view.number, view.timestamp, draw::DrawRunView(view));
}

}  // namespace alidade
