// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "alidade/model/params.h"
#include "alignment.h"

namespace alidade {

/// What is asked of a disparity.
struct DisparityOptions {
  double max_px;          ///< of the disparities that are looked for
  double min_similarity;  ///< of the target in both images
  double min_distinct;    ///< that the best match is better by than the next
  double max_row_px;      ///< between the rows of the target in both images
  double max_sigma_px;    ///< of the disparity

  explicit DisparityOptions(Params& p)
      : max_px(p.NonNegative("disparity.max_px", "px",
                             "the largest that is looked for: stereo is blind to what is nearer; "
                             "0: all of the image",
                             0.0)),
        min_similarity(p.Number("disparity.min_similarity", "1",
                                "the target correlates at least so much in both images",
                                {-1.0, 1.0}, 0.8)),
        min_distinct(p.Number("disparity.min_distinct", "1",
                              "so much better than the next is the best match, at least",
                              {0.0, 2.0}, 0.02)),
        max_row_px(p.Positive("disparity.max_row_px", "px",
                              "between the rows of the target in both images, at most", 1.5)),
        max_sigma_px(p.Positive("disparity.max_sigma_px", "px",
                                "with less texture, or another look, there is no disparity", 0.5)) {
  }
};

/// u_left - u_right of the middle of a target, px.
struct Disparity {
  double value, variance;
};

/// The target in `box` of the left image, found in the same rows of the right one: by correlation
/// at each disparity, then by alignment, whose slant takes up that of the target. `middle` is the
/// point whose disparity it is. None: no texture, no match, two matches, or part of it is not seen.
inline std::optional<Disparity> FindDisparity(const cv::Mat& left, const cv::Mat& right,
                                              const cv::Rect2d& box, cv::Point2d middle,
                                              const DisparityOptions& options) {
  const cv::Rect whole({0, 0}, left.size()), place = box;
  if ((place & whole) != place || place.width < 8 || place.height < 8) return std::nullopt;
  const int reach =
      options.max_px > 0.0 ? cvCeil(std::min(options.max_px, double(left.cols))) : place.x;
  const int from = std::max(0, place.x - reach);
  const cv::Mat strip = right(cv::Rect(from, place.y, place.x + place.width - from, place.height));
  cv::Mat patch, scores;
  left(place).convertTo(patch, CV_32F);
  cv::Scalar mean, deviation;
  cv::meanStdDev(patch, mean, deviation);
  if (deviation[0] < 1e-3) return std::nullopt;
  cv::matchTemplate(strip, left(place), scores, cv::TM_CCOEFF_NORMED);
  double best = 0.0;
  cv::Point at;
  cv::minMaxLoc(scores, nullptr, &best, nullptr, &at);
  const auto score = [&](int x) { return double(scores.at<float>(0, x)); };
  // The next best one beyond the valleys on both sides of the best.
  int low = at.x, high = at.x;
  while (low > 0 && score(low - 1) < score(low)) --low;
  while (high + 1 < scores.cols && score(high + 1) < score(high)) ++high;
  for (int x = 0; x < scores.cols; ++x) {
    if ((x < low || x > high) && score(x) > best - options.min_distinct) return std::nullopt;
  }
  const cv::Matx33d guess(1.0, 0.0, from + at.x, 0.0, 1.0, place.y, 0.0, 0.0, 1.0);
  cv::Mat grey;
  right.convertTo(grey, CV_32F);
  const auto found = Align(patch, grey, guess, Warp::kAffine);
  if (!found || found->similarity < options.min_similarity) return std::nullopt;
  const cv::Point2d in_patch = middle - cv::Point2d(place.tl());
  const auto column = [&](const cv::Matx33d& warp) { return Apply(warp, in_patch).x; };
  const double row = Apply(found->warp, in_patch).y;
  const Disparity disparity{middle.x - column(found->warp), found->Variance(patch, column)};
  const bool good = std::abs(row - middle.y) <= options.max_row_px &&
                    std::sqrt(disparity.variance) <= options.max_sigma_px &&
                    !(options.max_px > 0.0 && disparity.value > options.max_px);
  return good ? std::optional(disparity) : std::nullopt;
}

}  // namespace alidade
