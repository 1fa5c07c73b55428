// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core.hpp>
#include <opencv2/video/tracking.hpp>
#include <utility>
#include <vector>

namespace alidade {

/// Optical flow of points from one image to the next [Lucas1981], to a fraction of a pixel. It uses
/// pyramids of the images. The pyramid of an image is built once, when it is first used.
class PyramidFlow {
 public:
  /// `window_px` is the side of a patch, `levels` the number of levels above the image itself.
  PyramidFlow(int window_px, int levels) : window_(window_px, window_px), levels_(levels) {}

  /// Sets the next image, 8-bit grey. The image that was set by the previous call becomes the last
  /// image.
  void SetNextImage(const cv::Mat& image) {
    std::swap(last_, next_);
    image.copyTo(next_.image);
    next_.is_built = false;
  }

  /// Follows points from the last to the next image, and returns approximate positions. `start`
  /// contains the positions in the last image. `end` contains the expected positions in the next
  /// image, and receives the results. The image itself is only used if its pyramid has no levels
  /// above it. `found` is 0 for points that are not found.
  void TrackForward(const std::vector<cv::Point2f>& start, std::vector<cv::Point2f>& end,
                    std::vector<unsigned char>& found) {
    const std::vector<cv::Mat>&last = Build(last_), &next = Build(next_);
    const int skipped = last.size() > 1 ? 1 : 0;  // a small image has no level above it
    const float scale = skipped > 0 ? 0.5F : 1.0F;
    scaled_start_.clear();
    for (const cv::Point2f& point : start) scaled_start_.push_back(scale * point);
    for (cv::Point2f& point : end) point *= scale;
    cv::calcOpticalFlowPyrLK(std::vector(last.begin() + skipped, last.end()),
                             std::vector(next.begin() + skipped, next.end()), scaled_start_, end,
                             found, error_, window_, levels_ - skipped, kStop,
                             cv::OPTFLOW_USE_INITIAL_FLOW);
    for (cv::Point2f& point : end) point /= scale;
  }

  /// Follows points from the next to the last image. `start` contains the positions in the next
  /// image. `end` contains the expected positions, and receives the results. The expected positions
  /// must be close, because no pyramid is used.
  void TrackBackward(const std::vector<cv::Point2f>& start, std::vector<cv::Point2f>& end,
                     std::vector<unsigned char>& found) {
    cv::calcOpticalFlowPyrLK(Build(next_), Build(last_), start, end, found, error_, window_, 0,
                             kStop, cv::OPTFLOW_USE_INITIAL_FLOW);
  }

 private:
  struct Pyramid {
    cv::Mat image;
    std::vector<cv::Mat> levels;
    bool is_built = false;
  };

  /// Builds the pyramid without derivatives, because reading derivatives from memory takes longer
  /// than computing them.
  const std::vector<cv::Mat>& Build(Pyramid& pyramid) {
    if (!pyramid.is_built) {
      cv::buildOpticalFlowPyramid(pyramid.image, pyramid.levels, window_, levels_, false);
      pyramid.is_built = true;
    }
    return pyramid.levels;
  }

  inline static const cv::TermCriteria kStop{cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 30,
                                             0.01};
  cv::Size window_;
  int levels_;
  Pyramid last_, next_;
  std::vector<cv::Point2f> scaled_start_;
  std::vector<float> error_;
};

}  // namespace alidade
