// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace alidade {

/// Blur of a patch that moves evenly while the image is exposed: the mean along a segment,
///
///   blurred(x) = integral of patch(x + s L e) ds,   s in [-1/2, 1/2],   e = (cos angle, sin angle)
///
/// with L = length * the longer side of the patch.
struct MotionBlur {
  double angle = 0.0;   ///< rad, from the right to down, in the patch
  double length = 0.0;  ///< of the longer side of the patch; 0: sharp

  static constexpr double kLongest = 0.75;

  /// Around a patch of this size that is blurred, so that what moves into it is known, px.
  static int Margin(cv::Size size) {
    return cvCeil(0.5 * kLongest * std::max(size.width, size.height)) + 1;
  }
  /// Those that are tried: sharp, and four directions by four lengths.
  static std::vector<MotionBlur> Candidates() {
    std::vector<MotionBlur> all{{}};
    for (int direction = 0; direction < 4; ++direction) {
      for (int sixths = 1; sixths <= 4; ++sixths) {
        all.push_back({direction * CV_PI / 4.0, sixths / 6.0});
      }
    }
    return all;
  }
  /// This one, and the lengths halfway to the next candidates.
  std::vector<MotionBlur> Neighbours() const {
    if (length == 0.0) return {*this};
    return {*this, {angle, length - 1.0 / 12.0}, {angle, length + 1.0 / 12.0}};
  }

  /// The patch, of `size`, in the middle of `wide`, float, which has Margin() around it.
  cv::Mat Apply(const cv::Mat& wide, cv::Size size) const {
    const cv::Rect inner((wide.cols - size.width) / 2, (wide.rows - size.height) / 2, size.width,
                         size.height);
    const double length_px = length * std::max(size.width, size.height);
    if (length_px < 1.0) return wide(inner).clone();
    cv::Mat blurred;
    cv::filter2D(wide, blurred, CV_32F, Kernel(length_px), {-1, -1}, 0.0, cv::BORDER_REPLICATE);
    return blurred(inner).clone();
  }

  /// Whether the blur is that of an image in which the patch moved by `moved`, px of the patch,
  /// since the one before: along it, and 0.4 to 1.4 times as long. It is shorter for a short
  /// exposure, and longer where the motion becomes faster.
  bool Explains(cv::Point2d moved, cv::Size size) const {
    constexpr double kAlong = 0.8, kMinShare = 0.4, kMaxShare = 1.4;
    if (length == 0.0) return true;
    const double length_px = length * std::max(size.width, size.height);
    const double moved_px = cv::norm(moved);
    const double along = std::abs(moved.x * std::cos(angle) + moved.y * std::sin(angle));
    return along >= kAlong * moved_px && length_px >= kMinShare * moved_px &&
           length_px <= kMaxShare * moved_px;
  }

 private:
  /// The segment, drawn with weights that fall off linearly to the next pixels; its sum is 1.
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
