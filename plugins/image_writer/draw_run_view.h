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

/// Placement of a frame's image on the canvas. The image is scaled to the height kHeight or to the
/// width kMaxWidth, by at most kMaxScale, and is centred vertically.
struct Placement {
  static constexpr int kHeight = 720, kMaxWidth = 1280;  // px
  static constexpr double kMaxScale = 4.0;

  double scale;
  cv::Size size;  ///< size of the scaled image, px
  int top;

  explicit Placement(const GreyImage& image) {
    const double width = std::max(1, image.width), height = std::max(1, image.height);
    scale = std::min({kHeight / height, kMaxWidth / width, kMaxScale});
    // Video encoders need even sizes.
    size = {2 * cvRound(0.5 * scale * width), 2 * cvRound(0.5 * scale * height)};
    top = (kHeight - size.height) / 2;
  }
  /// Returns the position of the centre of pixel (u, v) on the canvas.
  cv::Point2d At(const std::array<double, 2>& pixel) const {
    return {(pixel[0] + 0.5) * scale - 0.5, top + (pixel[1] + 0.5) * scale - 0.5};
  }
};

/// Fades a colour towards grey with `age`, which is in [0, 1].
inline cv::Scalar Fade(const cv::Scalar& colour, double age) {
  return colour * (1.0 - age) + cv::Scalar(128, 128, 128) * age;
}

inline void DrawFeature(Canvas& canvas, const ViewFeature& feature, const Placement& placement) {
  const double radius = feature.predicted ? 2.4 : 3.2;  // px
  const cv::Scalar colour = ColourOf(feature.mark);
  cv::Point2d end = placement.At(feature.pixel);
  for (auto position = feature.trail.rbegin(); position != feature.trail.rend(); ++position) {
    const cv::Point2d start = placement.At(*position);
    const auto age = static_cast<double>(position - feature.trail.rbegin() + 1) /
                     static_cast<double>(feature.trail.size() + 1);
    canvas.Line(start, end, Fade(colour, age));
    end = start;
  }
  const cv::Point2d centre = placement.At(feature.pixel);
  if (feature.mark == Mark::kLost) return canvas.Cross(centre, 4.0, colour);
  canvas.Disc(centre, radius + 0.9, {0, 0, 0});
  if (feature.predicted) {
    const cv::Point2d h = placement.At({feature.predicted->x, feature.predicted->y});
    canvas.ThreeSigma(h, *feature.predicted, {placement.scale, placement.scale}, colour);
    if (feature.mark == Mark::kRejected) canvas.Line(h, centre, colour);
  }
  canvas.Disc(centre, radius, colour);
}

/// Draws the image of a frame with its features. Draws a panel with the estimate to the right of
/// the image.
inline cv::Mat DrawRunView(const RunView& view) {
  const Placement placement(view.image.grey);
  cv::Mat canvas_image(Placement::kHeight, placement.size.width + Panel::kWidth, CV_8UC3, kPaper);
  if (!view.image.grey.pixels.empty()) {
    cv::Mat grey(view.image.grey.height, view.image.grey.width, CV_8UC1), enlarged;
    std::ranges::copy(view.image.grey.pixels, grey.begin<unsigned char>());
    const int interpolation = placement.scale < 1.0 ? cv::INTER_AREA : cv::INTER_CUBIC;
    cv::resize(grey, enlarged, placement.size, 0.0, 0.0, interpolation);
    cv::Mat destination = canvas_image(cv::Rect({0, placement.top}, placement.size));
    cv::cvtColor(enlarged, destination, cv::COLOR_GRAY2BGR);
  }
  cv::Mat image_part = canvas_image(cv::Rect(0, 0, placement.size.width, Placement::kHeight));
  Canvas image_canvas(image_part);
  std::vector<cv::Point2d> outline;
  for (const auto& corner : view.image.outline) outline.push_back(placement.At(corner));
  image_canvas.Path(outline, {0, 0, 0}, 4, true);
  image_canvas.Path(outline, ColourOf(view.outline), 2, true);
  for (const ViewFeature& feature : view.features) DrawFeature(image_canvas, feature, placement);

  cv::Mat panel_part =
      canvas_image(cv::Rect(placement.size.width, 0, Panel::kWidth, Placement::kHeight));
  Panel(panel_part).Draw(view);
  return canvas_image;
}

}  // namespace alidade::draw
