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

/// Requirements for a disparity.
struct DisparityOptions {
  double max_px;          ///< largest disparity of the search; 0: the whole image
  double min_similarity;  ///< minimum correlation of the target between both images
  double min_distinct;    ///< minimum difference of the best and the next best correlation
  double max_row_px;      ///< maximum difference of the rows of the target
  double max_sigma_px;    ///< maximum standard deviation of a disparity

  explicit DisparityOptions(Params& p)
      : max_px(p.NumberOrNone("disparity.max_px", "px",
                              "largest disparity of the search; nearer targets have no disparity; "
                              "none: search the whole image",
                              kPositive)
                   .value_or(0.0)),
        min_similarity(p.Number("disparity.min_similarity", "1",
                                "minimum correlation of the target between both images",
                                {-1.0, 1.0}, 0.8)),
        min_distinct(p.Number("disparity.min_distinct", "1",
                              "minimum difference of the best and the next best correlation",
                              {0.0, 2.0}, 0.02)),
        max_row_px(p.Positive("disparity.max_row_px", "px",
                              "maximum difference of the rows of the target in both images", 1.5)),
        max_sigma_px(p.Positive("disparity.max_sigma_px", "px",
                                "maximum standard deviation of a disparity", 0.5)) {}
};

/// Disparity of the middle of a target, u_left - u_right, px.
struct Disparity {
  double value, variance;
};

/// Finds the target, which is in `box` of the left image, in the same rows of the right image.
/// Correlates both images at each disparity, then aligns the target. The alignment includes a
/// shear, for a slanted target. The disparity is that of the point `middle`. Returns nullopt if the
/// target has no texture, has no match or two matches, or is partly outside an image.
inline std::optional<Disparity> FindDisparity(const cv::Mat& left, const cv::Mat& right,
                                              const cv::Rect2d& box, cv::Point2d middle,
                                              const DisparityOptions& options) {
  const cv::Rect image_area({0, 0}, left.size()), box_pixels = box;
  if ((box_pixels & image_area) != box_pixels || box_pixels.width < 8 || box_pixels.height < 8)
    return std::nullopt;
  const int max_disparity =
      options.max_px > 0.0 ? cvCeil(std::min(options.max_px, double(left.cols))) : box_pixels.x;
  const int first_column = std::max(0, box_pixels.x - max_disparity);
  const cv::Mat strip =
      right(cv::Rect(first_column, box_pixels.y, box_pixels.x + box_pixels.width - first_column,
                     box_pixels.height));
  cv::Mat patch, scores;
  left(box_pixels).convertTo(patch, CV_32F);
  cv::Scalar mean, deviation;
  cv::meanStdDev(patch, mean, deviation);
  if (deviation[0] < 1e-3) return std::nullopt;
  cv::matchTemplate(strip, left(box_pixels), scores, cv::TM_CCOEFF_NORMED);
  double best = 0.0;
  cv::Point best_position;
  cv::minMaxLoc(scores, nullptr, &best, nullptr, &best_position);
  const auto score = [&](int x) { return double(scores.at<float>(0, x)); };
  // The next best match is searched for beyond the minima on both sides of the best match.
  int low = best_position.x, high = best_position.x;
  while (low > 0 && score(low - 1) < score(low)) --low;
  while (high + 1 < scores.cols && score(high + 1) < score(high)) ++high;
  for (int x = 0; x < scores.cols; ++x) {
    if ((x < low || x > high) && score(x) > best - options.min_distinct) return std::nullopt;
  }
  const cv::Matx33d guess(1.0, 0.0, first_column + best_position.x, 0.0, 1.0, box_pixels.y, 0.0,
                          0.0, 1.0);
  cv::Mat grey;
  right.convertTo(grey, CV_32F);
  const auto found = Align(patch, grey, guess, Warp::kAffine);
  if (!found || found->similarity < options.min_similarity) return std::nullopt;
  const cv::Point2d in_patch = middle - cv::Point2d(box_pixels.tl());
  const auto column = [&](const cv::Matx33d& warp) { return Apply(warp, in_patch).x; };
  const double row = Apply(found->warp, in_patch).y;
  const Disparity disparity{middle.x - column(found->warp), found->Variance(patch, column)};
  const bool is_valid = std::abs(row - middle.y) <= options.max_row_px &&
                        std::sqrt(disparity.variance) <= options.max_sigma_px &&
                        !(options.max_px > 0.0 && disparity.value > options.max_px);
  return is_valid ? std::optional(disparity) : std::nullopt;
}

}  // namespace alidade
