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

/// A quadrangle in an image or a patch, px, clockwise from the upper left.
using Corners = std::array<cv::Point2f, 4>;

/// From the unit square, its upper left corner first.
inline cv::Matx33d FromUnit(const Corners& corners) {
  const Corners unit{cv::Point2f(0.0F, 0.0F), {1.0F, 0.0F}, {1.0F, 1.0F}, {0.0F, 1.0F}};
  return cv::getPerspectiveTransform(unit.data(), corners.data());
}
inline Corners CornersOf(cv::Size size) {
  const auto right = static_cast<float>(size.width - 1);
  const auto bottom = static_cast<float>(size.height - 1);
  return {cv::Point2f(0.0F, 0.0F), {right, 0.0F}, {right, bottom}, {0.0F, bottom}};
}
inline Corners Moved(const cv::Matx33d& warp, const Corners& corners) {
  Corners moved;
  std::ranges::transform(corners, moved.begin(),
                         [&](cv::Point2f at) { return cv::Point2f(Apply(warp, at)); });
  return moved;
}
inline double AreaOf(const Corners& corners) {
  return cv::contourArea(std::vector<cv::Point2f>(corners.begin(), corners.end()));
}
inline cv::Point2f MiddleOf(const Corners& corners) {
  return 0.25F * (corners[0] + corners[1] + corners[2] + corners[3]);
}

/// What a target looked like in one image.
class TargetTemplate {
 public:
  /// `grey`: the image, as float. `scale`: the inverse scale there; `variance`: of it, relative.
  TargetTemplate(const cv::Mat& grey, const Corners& outline, double scale, double variance)
      : scale_(scale), variance_(variance) {
    const double width =
        0.5 * (cv::norm(outline[1] - outline[0]) + cv::norm(outline[2] - outline[3]));
    const double height =
        0.5 * (cv::norm(outline[3] - outline[0]) + cv::norm(outline[2] - outline[1]));
    size_ = {std::max(8, cvRound(width)), std::max(8, cvRound(height))};
    taken_ = To(outline);
    const int margin = MotionBlur::Margin(size_);
    const cv::Matx33d from_wide(1, 0, -margin, 0, 1, -margin, 0, 0, 1);
    cv::warpPerspective(grey, wide_, taken_ * from_wide, size_ + cv::Size(2 * margin, 2 * margin),
                        cv::INTER_LINEAR | cv::WARP_INVERSE_MAP, cv::BORDER_REPLICATE);
    patch_ = Blurred({});
  }

  const cv::Mat& patch() const { return patch_; }  ///< within the outline, grey as float
  cv::Mat Blurred(const MotionBlur& blur) const { return blur.Apply(wide_, size_); }
  /// Where it was taken: from the patch to that image.
  const cv::Matx33d& taken() const { return taken_; }
  double scale() const { return scale_; }        ///< inverse scale there
  double variance() const { return variance_; }  ///< of scale, relative: of its square
  Corners corners() const { return CornersOf(size_); }
  /// From the patch to where its corners are in an image.
  cv::Matx33d To(const Corners& outline) const {
    return cv::getPerspectiveTransform(corners().data(), outline.data());
  }

  /// integral of |gradient|^2 / variance of the grey: less where it is blurred, and the same in any
  /// light and at any size.
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
  cv::Mat wide_;  ///< patch_ with a margin around it
  cv::Mat patch_;
  cv::Matx33d taken_;
  double scale_, variance_;
};

}  // namespace alidade
