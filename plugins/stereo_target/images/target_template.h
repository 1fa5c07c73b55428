// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "alignment.h"
#include "motion_blur.h"

namespace alidade {

/// Quadrangle in an image or a patch, px, clockwise from the upper left.
using Corners = std::array<cv::Point2f, 4>;

/// Returns the warp from the unit square to `corners`. The warp maps the upper left corner of the
/// square to the first corner.
inline cv::Matx33d FromUnit(const Corners& corners) {
  const Corners unit{cv::Point2f(0.0F, 0.0F), {1.0F, 0.0F}, {1.0F, 1.0F}, {0.0F, 1.0F}};
  return cv::getPerspectiveTransform(unit.data(), corners.data());
}
inline Corners CornersOf(cv::Size size) {
  const auto right = static_cast<float>(size.width - 1);
  const auto bottom = static_cast<float>(size.height - 1);
  return {cv::Point2f(0.0F, 0.0F), {right, 0.0F}, {right, bottom}, {0.0F, bottom}};
}
inline Corners ApplyToCorners(const cv::Matx33d& warp, const Corners& corners) {
  Corners transformed;
  std::ranges::transform(corners, transformed.begin(),
                         [&](cv::Point2f corner) { return cv::Point2f(Apply(warp, corner)); });
  return transformed;
}
inline double AreaOf(const Corners& corners) {
  return cv::contourArea(std::vector<cv::Point2f>(corners.begin(), corners.end()));
}
inline cv::Point2f MiddleOf(const Corners& corners) {
  return 0.25F * (corners[0] + corners[1] + corners[2] + corners[3]);
}

/// Appearance of a target in one image.
class TargetTemplate {
 public:
  /// `grey` is the image, with grey values of type float. `scale` is the inverse scale of the
  /// target in this image, and `variance` is the relative variance of `scale`.
  TargetTemplate(const cv::Mat& grey, const Corners& outline, double scale, double variance)
      : scale_(scale), variance_(variance) {
    const double width =
        0.5 * (cv::norm(outline[1] - outline[0]) + cv::norm(outline[2] - outline[3]));
    const double height =
        0.5 * (cv::norm(outline[3] - outline[0]) + cv::norm(outline[2] - outline[1]));
    size_ = {std::max(8, cvRound(width)), std::max(8, cvRound(height))};
    image_from_patch_ = WarpTo(outline);
    const int margin = MotionBlur::Margin(size_);
    const cv::Matx33d from_padded(1, 0, -margin, 0, 1, -margin, 0, 0, 1);
    cv::warpPerspective(grey, padded_patch_, image_from_patch_ * from_padded,
                        size_ + cv::Size(2 * margin, 2 * margin),
                        cv::INTER_LINEAR | cv::WARP_INVERSE_MAP, cv::BORDER_REPLICATE);
    patch_ = Blurred({});
  }

  const cv::Mat& patch() const { return patch_; }  ///< image within the outline, float
  cv::Mat Blurred(const MotionBlur& blur) const { return blur.Apply(padded_patch_, size_); }
  /// Returns the warp from the patch to the image that contains the template.
  const cv::Matx33d& image_from_patch() const { return image_from_patch_; }
  double scale() const { return scale_; }        ///< inverse scale in the image
  double variance() const { return variance_; }  ///< relative variance of scale
  Corners corners() const { return CornersOf(size_); }
  /// Returns the warp from the patch to an outline in an image.
  cv::Matx33d WarpTo(const Corners& outline) const {
    return cv::getPerspectiveTransform(corners().data(), outline.data());
  }

  /// Returns the integral of |gradient|^2, divided by the variance of the grey values. Blur reduces
  /// this number; light and size do not affect it.
  double Sharpness() const {
    cv::Mat right, down;
    cv::Sobel(patch_, right, CV_32F, 1, 0, 3, 0.125);
    cv::Sobel(patch_, down, CV_32F, 0, 1, 3, 0.125);
    cv::Scalar mean, deviation;
    cv::meanStdDev(patch_, mean, deviation);
    const double squares = right.dot(right) + down.dot(down);
    return deviation[0] > 0.0 ? squares / (deviation[0] * deviation[0]) : 0.0;
  }

 private:
  cv::Size size_;
  cv::Mat padded_patch_;  ///< patch_ with a margin
  cv::Mat patch_;
  cv::Matx33d image_from_patch_;
  double scale_, variance_;
};

}  // namespace alidade
