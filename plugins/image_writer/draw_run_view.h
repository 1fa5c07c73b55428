// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <utility>
#include <vector>

#include "alidade/record/run_view.h"
#include "canvas.h"
#include "draw_panel.h"

namespace alidade::draw {

/// How the image of a frame lies on the canvas: enlarged to a height of kHeight or a width of
/// kWidest, in the middle of its column.
struct Placing {
  static constexpr int kHeight = 720, kWidest = 1280;  // px
  static constexpr double kMostTimes = 4.0;

  double times;
  cv::Size size;  ///< of the enlarged image
  int top;

  explicit Placing(const GreyImage& image) {
    const double width = std::max(1, image.width), height = std::max(1, image.height);
    times = std::min({kHeight / height, kWidest / width, kMostTimes});
    // Videos want even sizes.
    size = {2 * cvRound(0.5 * times * width), 2 * cvRound(0.5 * times * height)};
    top = (kHeight - size.height) / 2;
  }
  /// Where the centre of pixel (u, v) lies.
  cv::Point2d At(const std::array<double, 2>& pixel) const {
    return {(pixel[0] + 0.5) * times - 0.5, top + (pixel[1] + 0.5) * times - 0.5};
  }
};

/// Towards grey with age, which is in [0, 1].
inline cv::Scalar Fade(const cv::Scalar& colour, double age) {
  return colour * (1.0 - age) + cv::Scalar(128, 128, 128) * age;
}

inline void DrawFeature(Canvas& canvas, const ViewFeature& feature, const Placing& placing) {
  const double radius = feature.predicted ? 2.4 : 3.2;  // px; larger where no ellipse is around it
  const cv::Scalar colour = ColourOf(feature.mark);
  cv::Point2d to = placing.At(feature.at);
  for (auto at = feature.tail.rbegin(); at != feature.tail.rend(); ++at) {
    const cv::Point2d from = placing.At(*at);
    const auto age = static_cast<double>(at - feature.tail.rbegin() + 1) /
                     static_cast<double>(feature.tail.size() + 1);
    canvas.Line(from, to, Fade(colour, age));
    to = from;
  }
  const cv::Point2d at = placing.At(feature.at);
  if (feature.mark == Mark::kLost) return canvas.Cross(at, 4.0, colour);
  canvas.Disc(at, radius + 0.9, {0, 0, 0});
  if (feature.predicted) {
    const cv::Point2d h = placing.At({feature.predicted->x, feature.predicted->y});
    canvas.ThreeSigma(h, *feature.predicted, {placing.times, placing.times}, colour);
    if (feature.mark == Mark::kRejected) canvas.Line(h, at, colour);
  }
  canvas.Disc(at, radius, colour);
}

/// The frame's image with its features, and a panel with the estimate at its right.
inline cv::Mat DrawRunView(const RunView& view) {
  const Placing placing(view.image.grey);
  cv::Mat canvas_image(Placing::kHeight, placing.size.width + Panel::kWidth, CV_8UC3, kPaper);
  if (!view.image.grey.pixels.empty()) {
    cv::Mat grey(view.image.grey.height, view.image.grey.width, CV_8UC1), large;
    std::ranges::copy(view.image.grey.pixels, grey.begin<unsigned char>());
    const int how = placing.times < 1.0 ? cv::INTER_AREA : cv::INTER_CUBIC;
    cv::resize(grey, large, placing.size, 0.0, 0.0, how);
    cv::Mat place = canvas_image(cv::Rect({0, placing.top}, placing.size));
    cv::cvtColor(large, place, cv::COLOR_GRAY2BGR);
  }
  cv::Mat left = canvas_image(cv::Rect(0, 0, placing.size.width, Placing::kHeight));
  Canvas on_image(left);
  std::vector<cv::Point2d> outline;
  for (const auto& corner : view.image.outline) outline.push_back(placing.At(corner));
  on_image.Path(outline, {0, 0, 0}, 4, true);
  on_image.Path(outline, ColourOf(view.outline), 2, true);
  for (const ViewFeature& feature : view.features) DrawFeature(on_image, feature, placing);

  cv::Mat right = canvas_image(cv::Rect(placing.size.width, 0, Panel::kWidth, Placing::kHeight));
  Panel(right).Draw(view);
  return canvas_image;
}

}  // namespace alidade::draw
