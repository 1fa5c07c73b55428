// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core.hpp>
#include <opencv2/video/tracking.hpp>
#include <utility>
#include <vector>

namespace alidade {

/// Where points of one image are in the next, by pyramids of patches [Lucas1981], to a fraction of
/// a pixel. A pyramid is made where one is asked for, once for each image.
class PyramidFlow {
 public:
  /// `window_px` side of a patch; `levels` above the image itself.
  PyramidFlow(int window_px, int levels) : window_(window_px, window_px), levels_(levels) {}

  /// Takes the next image, 8 bit grey; the one before it becomes the last.
  void Take(const cv::Mat& image) {
    std::swap(last_, next_);
    image.copyTo(next_.image);
    next_.is_built = false;
  }

  /// Moves `to` from where the points `from` of the last image are looked for in the next to about
  /// where they are, by the levels above the image itself where there are any. `found`: 0 where
  /// they are lost.
  void Forward(const std::vector<cv::Point2f>& from, std::vector<cv::Point2f>& to,
               std::vector<unsigned char>& found) {
    const std::vector<cv::Mat>&last = Build(last_), &next = Build(next_);
    const int skipped = last.size() > 1 ? 1 : 0;  // a small image has no levels above it
    const float scale = skipped > 0 ? 0.5F : 1.0F;
    from_.clear();
    for (const cv::Point2f& at : from) from_.push_back(scale * at);
    for (cv::Point2f& at : to) at *= scale;
    cv::calcOpticalFlowPyrLK(std::vector(last.begin() + skipped, last.end()),
                             std::vector(next.begin() + skipped, next.end()), from_, to, found,
                             error_, window_, levels_ - skipped, kStop,
                             cv::OPTFLOW_USE_INITIAL_FLOW);
    for (cv::Point2f& at : to) at /= scale;
  }

  /// Moves `to`, points of the last image, to where the points `from` of the next one were; what is
  /// near needs no pyramid.
  void Back(const std::vector<cv::Point2f>& from, std::vector<cv::Point2f>& to,
            std::vector<unsigned char>& found) {
    cv::calcOpticalFlowPyrLK(Build(next_), Build(last_), from, to, found, error_, window_, 0, kStop,
                             cv::OPTFLOW_USE_INITIAL_FLOW);
  }

 private:
  struct Pyramid {
    cv::Mat image;
    std::vector<cv::Mat> levels;
    bool is_built = false;
  };

  /// Derivatives that wait in memory are slower than those that are computed where they are used.
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
  std::vector<cv::Point2f> from_;
  std::vector<float> error_;
};

}  // namespace alidade
