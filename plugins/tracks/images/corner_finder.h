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

/// Finds corners [Shi1994] in images, row by row of cells of the grid: the search takes longer than
/// features are followed.
class CornerFinder {
 public:
  /// With its response.
  using Corner = std::pair<float, cv::Point>;

  explicit CornerFinder(const TrackerOptions& options) : options_(options) {}

  /// The corners of the rows whose turn it is, as many as `missing` features fill, rounded up; the
  /// strongest first. None is nearer to the rim than can be followed.
  const std::vector<Corner>& Find(const cv::Mat& image, int missing) {
    const int rows = options_.cells[1];
    const auto share = static_cast<double>(missing) / options_.features;
    const int count = std::clamp(static_cast<int>(std::ceil(share * rows)), 1, rows);
    strongest_.resize(static_cast<std::size_t>(rows), 0.0);
    corners_.clear();
    if (count == rows) turn_ = 0;  // all at once: none by what an image before had
    const int last = std::min(rows, turn_ + count);
    Search(image, turn_, last);
    if (last < turn_ + count) Search(image, 0, turn_ + count - rows);
    turn_ = (turn_ + count) % rows;
    std::ranges::stable_sort(corners_, std::greater(), &Corner::first);
    return corners_;
  }

 private:
  /// The local maxima of the response in the rows of cells [first, last).
  void Search(const cv::Mat& image, int first, int last) {
    const int rows = options_.cells[1];
    const auto top_of = [&](int row) { return (row * image.rows + rows - 1) / rows; };
    const int reach = options_.corner_px / 2 + 2;  // of the response, its derivatives and maxima
    const int top = std::max(0, top_of(first) - reach);
    const int bottom = std::min(image.rows, top_of(last) + reach);
    cv::cornerMinEigenVal(image.rowRange(top, bottom), response_, options_.corner_px);
    cv::dilate(response_, largest_, cv::Mat());
    const int margin = options_.margin();
    for (int row = first; row < last; ++row) {
      double& strongest = strongest_[static_cast<std::size_t>(row)];
      strongest = 0.0;
      if (top_of(row) == top_of(row + 1)) continue;
      cv::minMaxLoc(response_.rowRange(top_of(row) - top, top_of(row + 1) - top), nullptr,
                    &strongest);
    }
    // Of the whole image: in the other rows as they were when they were searched.
    const auto least = static_cast<float>(options_.quality * *std::ranges::max_element(strongest_));
    const int y_end = std::min(top_of(last), image.rows - margin);
    for (int y = std::max(top_of(first), margin); y < y_end; ++y) {
      const float* const own = response_.ptr<float>(y - top);
      const float* const around = largest_.ptr<float>(y - top);
      for (int x = margin; x < image.cols - margin; ++x) {
        if (own[x] > least && own[x] == around[x]) corners_.emplace_back(own[x], cv::Point(x, y));
      }
    }
  }

  TrackerOptions options_;
  std::vector<double> strongest_;  ///< response in each row of cells, when it was searched
  int turn_ = 0;                   ///< the row of cells that is searched next
  std::vector<Corner> corners_;
  cv::Mat response_, largest_;
};

/// The point of the patch about `start` that stays with it when it grows, turns or is sheared, and
/// not only when it is shifted [Forstner1987]: p = (sum g g')^-1 sum g g' x, g the gradient at x. A
/// patch about any other point would be followed to a point that drifts from it. `start` where
/// there is none near it that can be followed.
inline cv::Point2f StablePoint(const cv::Mat& image, const TrackerOptions& options,
                               cv::Point2f start) {
  constexpr int kMost = 5;
  constexpr float kFarthest = 6.0F, kSettled = 0.02F;  // px
  const auto margin = static_cast<float>(options.margin());
  const cv::Rect2f inside(margin, margin, static_cast<float>(image.cols) - 2.0F * margin,
                          static_cast<float>(image.rows) - 2.0F * margin);
  const int side = options.window_px | 1, middle = 1 + side / 2;
  cv::Point2f at = start;
  cv::Mat patch;
  for (int i = 0; i < kMost; ++i) {
    cv::getRectSubPix(image, cv::Size(side + 2, side + 2), at, patch, CV_32F);
    cv::Matx22d normal = cv::Matx22d::zeros();
    cv::Vec2d right(0.0, 0.0);
    for (int y = 1; y <= side; ++y) {
      for (int x = 1; x <= side; ++x) {
        const double gx = patch.at<float>(y, x + 1) - patch.at<float>(y, x - 1);
        const double gy = patch.at<float>(y + 1, x) - patch.at<float>(y - 1, x);
        const double along = gx * (x - middle) + gy * (y - middle);
        normal += cv::Matx22d(gx * gx, gx * gy, gx * gy, gy * gy);
        right += along * cv::Vec2d(gx, gy);
      }
    }
    if (!(cv::determinant(normal) > 0.0)) return start;
    const cv::Vec2d shift = normal.inv() * right;
    at += cv::Point2f(static_cast<float>(shift[0]), static_cast<float>(shift[1]));
    if (!(cv::norm(at - start) < kFarthest) || !inside.contains(at)) return start;
    if (cv::norm(shift) < kSettled) break;
  }
  return at;
}

}  // namespace alidade
