// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace alidade {

/// Blur of a patch that moves at constant velocity during the exposure. The blurred patch is the
/// mean of the patch along a segment:
///
///   blurred(x) = integral of patch(x + s L e) ds,   s in [-1/2, 1/2],   e = (cos angle, sin angle)
///
/// L is `length` times the longer side of the patch.
struct MotionBlur {
  double angle = 0.0;   ///< direction in the patch, rad; 0: right, pi/2: down
  double length = 0.0;  ///< relative to the longer side of the patch; 0: no blur

  static constexpr double kMaxLength = 0.75;

  /// Returns the margin, px, that a blurred patch of this size needs around it.
  static int Margin(cv::Size size) {
    return cvCeil(0.5 * kMaxLength * std::max(size.width, size.height)) + 1;
  }
  /// Returns the candidates: no blur, and blurs in four directions with four lengths each.
  static std::vector<MotionBlur> Candidates() {
    std::vector<MotionBlur> candidates{{}};
    for (int direction = 0; direction < 4; ++direction) {
      for (int sixths = 1; sixths <= 4; ++sixths) {
        candidates.push_back({direction * CV_PI / 4.0, sixths / 6.0});
      }
    }
    return candidates;
  }
  /// Returns this blur, and the blurs with lengths halfway to the next candidates.
  std::vector<MotionBlur> Neighbours() const {
    if (length == 0.0) return {*this};
    return {*this, {angle, length - 1.0 / 12.0}, {angle, length + 1.0 / 12.0}};
  }

  /// Returns the blurred patch of `size`, with grey values of type float. `padded_patch` is the
  /// sharp patch with Margin() on each side.
  cv::Mat Apply(const cv::Mat& padded_patch, cv::Size size) const {
    const cv::Rect inner((padded_patch.cols - size.width) / 2,
                         (padded_patch.rows - size.height) / 2, size.width, size.height);
    const double length_px = length * std::max(size.width, size.height);
    if (length_px < 1.0) return padded_patch(inner).clone();
    cv::Mat blurred;
    cv::filter2D(padded_patch, blurred, CV_32F, Kernel(length_px), {-1, -1}, 0.0,
                 cv::BORDER_REPLICATE);
    return blurred(inner).clone();
  }

  /// Returns true if this blur fits `motion`, the motion of the patch since the previous image, in
  /// px of the patch. The blur must be along the motion, and 0.4 to 1.4 times as long as the
  /// motion. A short exposure shortens the blur. An accelerating motion lengthens the blur.
  bool Explains(cv::Point2d motion, cv::Size size) const {
    constexpr double kMinAlignment = 0.8, kMinRatio = 0.4, kMaxRatio = 1.4;
    if (length == 0.0) return true;
    const double length_px = length * std::max(size.width, size.height);
    const double motion_px = cv::norm(motion);
    const double along_blur = std::abs(motion.x * std::cos(angle) + motion.y * std::sin(angle));
    return along_blur >= kMinAlignment * motion_px && length_px >= kMinRatio * motion_px &&
           length_px <= kMaxRatio * motion_px;
  }

 private:
  /// Returns the segment as a filter kernel with the sum 1. Each point of the segment is
  /// distributed linearly over the nearest pixels.
  cv::Mat Kernel(double length_px) const {
    const int half = cvCeil(0.5 * length_px), side = 2 * half + 1, samples = 8 * side;
    cv::Mat kernel(side, side, CV_32F, cv::Scalar(0.0));
    for (int i = 0; i < samples; ++i) {
      const double s = ((i + 0.5) / samples - 0.5) * length_px;
      const double x = half + s * std::cos(angle), y = half + s * std::sin(angle);
      const int column = std::min(static_cast<int>(x), side - 2);
      const int row = std::min(static_cast<int>(y), side - 2);
      const double a = x - column, b = y - row;
      const auto add = [&](int r, int c, double weight) {
        kernel.at<float>(r, c) += static_cast<float>(weight / samples);
      };
      add(row, column, (1.0 - a) * (1.0 - b));
      add(row, column + 1, a * (1.0 - b));
      add(row + 1, column, (1.0 - a) * b);
      add(row + 1, column + 1, a * b);
    }
    return kernel;
  }
};

}  // namespace alidade
