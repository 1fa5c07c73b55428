// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>
#include <vector>

#include "tracker_options.h"

namespace alidade {

/// Finder of corners [Shi1994] in images. In each image only some rows of grid cells are searched,
/// because a search takes longer than the tracking of features.
class CornerFinder {
 public:
  /// Response and position of a corner.
  using Corner = std::pair<float, cv::Point>;

  explicit CornerFinder(const TrackerOptions& options) : options_(options) {}

  /// Returns the corners of the next rows of cells, the strongest first. Searches as many rows of
  /// cells as `missing` features would fill, rounded up. Omits corners that are too close to the
  /// rim for tracking.
  const std::vector<Corner>& Find(const cv::Mat& image, int missing) {
    const int rows = options_.cells[1];
    const auto fraction = static_cast<double>(missing) / options_.features;
    const int count = std::clamp(static_cast<int>(std::ceil(fraction * rows)), 1, rows);
    strongest_.resize(static_cast<std::size_t>(rows), 0.0);
    corners_.clear();
    if (count == rows) next_row_ = 0;  // the threshold then uses only this image
    const int last = std::min(rows, next_row_ + count);
    Search(image, next_row_, last);
    if (last < next_row_ + count) Search(image, 0, next_row_ + count - rows);
    next_row_ = (next_row_ + count) % rows;
    std::ranges::stable_sort(corners_, std::greater(), &Corner::first);
    return corners_;
  }

 private:
  /// Appends the local maxima of the response in the rows of cells [first, last).
  void Search(const cv::Mat& image, int first, int last) {
    const int rows = options_.cells[1];
    const auto top_row = [&](int row) { return (row * image.rows + rows - 1) / rows; };
    const int reach = options_.corner_px / 2 + 2;  // rows of pixels needed beyond the cells
    const int top = std::max(0, top_row(first) - reach);
    const int bottom = std::min(image.rows, top_row(last) + reach);
    cv::cornerMinEigenVal(image.rowRange(top, bottom), response_, options_.corner_px);
    cv::dilate(response_, largest_, cv::Mat());
    const int margin = options_.margin();
    for (int row = first; row < last; ++row) {
      double& strongest = strongest_[static_cast<std::size_t>(row)];
      strongest = 0.0;
      if (top_row(row) == top_row(row + 1)) continue;
      cv::minMaxLoc(response_.rowRange(top_row(row) - top, top_row(row + 1) - top), nullptr,
                    &strongest);
    }
    // The threshold is relative to the maximum of the whole image. A row of cells that is not
    // searched now contributes the maximum of its last search.
    const auto threshold =
        static_cast<float>(options_.quality * *std::ranges::max_element(strongest_));
    const int y_end = std::min(top_row(last), image.rows - margin);
    for (int y = std::max(top_row(first), margin); y < y_end; ++y) {
      const float* const responses = response_.ptr<float>(y - top);
      const float* const maxima = largest_.ptr<float>(y - top);
      for (int x = margin; x < image.cols - margin; ++x) {
        if (responses[x] > threshold && responses[x] == maxima[x])
          corners_.emplace_back(responses[x], cv::Point(x, y));
      }
    }
  }

  TrackerOptions options_;
  std::vector<double> strongest_;  ///< maximum of each row of cells in its last search
  int next_row_ = 0;               ///< row of cells to search next
  std::vector<Corner> corners_;
  cv::Mat response_, largest_;
};

/// Returns the point near `start` that alignment finds most precisely. This point does not move if
/// its patch grows, turns or is sheared [Forstner1987]:
///
///   p = (sum g g')^-1 sum g g' x,   with the gradient g at x
///
/// Any other point would drift during tracking. Returns `start` if there is no such point nearby,
/// or if this point is too close to the rim for tracking.
inline cv::Point2f StablePoint(const cv::Mat& image, const TrackerOptions& options,
                               cv::Point2f start) {
  constexpr int kMaxIterations = 5;
  constexpr float kMaxDistance = 6.0F, kSettled = 0.02F;  // px
  const auto margin = static_cast<float>(options.margin());
  const cv::Rect2f inside(margin, margin, static_cast<float>(image.cols) - 2.0F * margin,
                          static_cast<float>(image.rows) - 2.0F * margin);
  const int side = options.window_px | 1, middle = 1 + side / 2;
  cv::Point2f point = start;
  cv::Mat patch;
  for (int i = 0; i < kMaxIterations; ++i) {
    cv::getRectSubPix(image, cv::Size(side + 2, side + 2), point, patch, CV_32F);
    cv::Matx22d normal = cv::Matx22d::zeros();
    cv::Vec2d right(0.0, 0.0);
    for (int y = 1; y <= side; ++y) {
      for (int x = 1; x <= side; ++x) {
        const double gx = patch.at<float>(y, x + 1) - patch.at<float>(y, x - 1);
        const double gy = patch.at<float>(y + 1, x) - patch.at<float>(y - 1, x);
        const double radial = gx * (x - middle) + gy * (y - middle);
        normal += cv::Matx22d(gx * gx, gx * gy, gx * gy, gy * gy);
        right += radial * cv::Vec2d(gx, gy);
      }
    }
    if (!(cv::determinant(normal) > 0.0)) return start;
    const cv::Vec2d shift = normal.inv() * right;
    point += cv::Point2f(static_cast<float>(shift[0]), static_cast<float>(shift[1]));
    if (!(cv::norm(point - start) < kMaxDistance) || !inside.contains(point)) return start;
    if (cv::norm(shift) < kSettled) break;
  }
  return point;
}

}  // namespace alidade
