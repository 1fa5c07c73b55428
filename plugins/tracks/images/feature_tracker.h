// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>
#include <utility>
#include <vector>

#include "alidade/model/params.h"

namespace alidade {

/// How features are found and followed.
struct TrackerOptions {
  int features;                ///< as many are followed, where the image has them
  std::array<int, 2> cells;    ///< columns and rows of the grid that spreads them
  double distance_px;          ///< between two, at least
  double quality;              ///< least response of a corner, of the strongest in the image
  int corner_px;               ///< side of the patch over which a corner is told
  int window_px;               ///< side of the patch that is followed
  int levels;                  ///< of the pyramid, above the image itself
  double forward_backward_px;  ///< between a feature and where it is followed back to, at most
  double least_similarity;  ///< of the patch now and where the feature was found: their correlation

  explicit TrackerOptions(Params& p)
      : features(p.Integer("features", "features that are followed, where the image has them", 1,
                           100'000, 100)),
        cells{p.Integer("grid_columns", "of the grid over which features are spread", 1, 1000, 8),
              p.Integer("grid_rows", "of that grid", 1, 1000, 6)},
        distance_px(
            p.Number("distance_px", "px", "between two features, at least", {1.0, 1e4}, 12.0)),
        quality(p.Number("quality", "1",
                         "least response of a corner, as a share of the strongest of its image",
                         {0.0, 1.0, true, true}, 0.01)),
        corner_px(p.Integer("corner_px",
                            "side of the patch over which a corner is told: small marks, such as "
                            "discs, are found at their middle where it is larger than they are",
                            3, 101, 5)),
        window_px(p.Integer("window_px", "side of the patch that is followed", 5, 101, 21)),
        levels(p.Integer("pyramid_levels", "halved images above the image itself", 0, 10, 3)),
        forward_backward_px(p.Positive(
            "forward_backward_px", "px",
            "a feature is lost where it is followed back to farther from where it was", 0.5)),
        least_similarity(p.Number(
            "least_similarity", "1",
            "a feature is lost where its patch correlates less with that where it was found",
            {-1.0, 1.0}, 0.7)) {}
};

/// Follows corners from image to image [Lucas1981], and finds new ones
/// [Shi1994] where a cell of the grid has fewer than its share. A feature is lost where its
/// patch leaves the image, where it is not followed back to where it was [Kalal2010], where it no
/// longer looks as it did when it was found, and where it comes as close to an older one as half of
/// the least distance. Where more than three quarters are lost at once, all are. It keeps its id as
/// long as it lives, and no other has it.
class FeatureTracker {
 public:
  struct Feature {
    std::int64_t id;
    cv::Point2f at;  ///< px; the centre of the upper left pixel is (0, 0)
    cv::Mat found;   ///< its patch where it was found
  };

  explicit FeatureTracker(const TrackerOptions& options) : options_(options) {}

  /// The features in the next image, by id. All images are of one size, 8 bit grey.
  const std::vector<Feature>& Track(const cv::Mat& image) {
    const cv::Size window(options_.window_px, options_.window_px);
    // Derivatives that wait in memory are slower than those that are computed where they are used.
    cv::buildOpticalFlowPyramid(image, pyramid_, window, options_.levels, false);
    if (!features_.empty()) Follow(image, window);
    if (std::ssize(features_) < options_.features) Refill(image);
    std::swap(pyramid_, before_);
    return features_;
  }

 private:
  void Follow(const cv::Mat& image, cv::Size window) {
    const cv::Size size = image.size();
    from_.clear();
    for (const Feature& feature : features_) from_.push_back(feature.at);
    cv::calcOpticalFlowPyrLK(before_, pyramid_, from_, to_, found_, error_, window, options_.levels,
                             kStop);
    // Back from where it is to where it was: what is near needs no pyramid.
    back_ = from_;
    cv::calcOpticalFlowPyrLK(pyramid_, before_, to_, back_, found_back_, error_, window, 0, kStop,
                             cv::OPTFLOW_USE_INITIAL_FLOW);
    const int half = options_.window_px / 2;
    const auto margin = static_cast<float>(half);
    const cv::Rect2f inside(margin, margin, static_cast<float>(size.width - 1) - 2.0F * margin,
                            static_cast<float>(size.height - 1) - 2.0F * margin);
    taken_.create(size, CV_8UC1);
    taken_.setTo(0);
    std::size_t kept = 0;
    for (std::size_t i = 0; i < features_.size(); ++i) {
      const cv::Point2f at = to_[i];
      if (found_[i] == 0 || found_back_[i] == 0 || !inside.contains(at) ||
          cv::norm(back_[i] - from_[i]) > options_.forward_backward_px ||
          taken_.at<unsigned char>(cv::Point(at)) != 0 ||
          Similarity(image, at, features_[i].found) < options_.least_similarity) {
        continue;
      }
      cv::circle(taken_, cv::Point(at), static_cast<int>(options_.distance_px / 2.0), 1,
                 cv::FILLED);
      Feature& feature = features_[kept++];
      std::swap(feature, features_[i]);
      feature.at = at;
    }
    // Of an image that has nothing to do with the one before, some are found at what looks alike.
    if (4 * kept < features_.size()) kept = 0;
    features_.resize(kept);
  }

  /// The strongest corners of each cell that has fewer features than its share.
  void Refill(const cv::Mat& image) {
    cv::cornerMinEigenVal(image, response_, options_.corner_px);
    cv::dilate(response_, largest_, cv::Mat());
    double strongest = 0.0;
    cv::minMaxLoc(response_, nullptr, &strongest);
    const auto least = static_cast<float>(options_.quality * strongest);
    const int margin = options_.window_px / 2 + 1;
    corners_.clear();
    for (int y = margin; y < image.rows - margin; ++y) {
      const float* const own = response_.ptr<float>(y);
      const float* const around = largest_.ptr<float>(y);
      for (int x = margin; x < image.cols - margin; ++x) {
        if (own[x] > least && own[x] == around[x]) corners_.emplace_back(own[x], cv::Point(x, y));
      }
    }
    std::ranges::stable_sort(corners_, std::greater(), &std::pair<float, cv::Point>::first);
    taken_.create(image.size(), CV_8UC1);
    taken_.setTo(0);
    const int cells = options_.cells[0] * options_.cells[1];
    std::vector<int> count(static_cast<std::size_t>(cells), 0);
    const auto cell_of = [&](cv::Point at) {
      const auto column = static_cast<std::size_t>(at.x * options_.cells[0] / image.cols);
      const auto row = static_cast<std::size_t>(at.y * options_.cells[1] / image.rows);
      return row * static_cast<std::size_t>(options_.cells[0]) + column;
    };
    const auto take = [&](cv::Point at) {
      cv::circle(taken_, at, static_cast<int>(options_.distance_px), 1, cv::FILLED);
      ++count[cell_of(at)];
    };
    for (const Feature& feature : features_) take(cv::Point(feature.at));
    const std::size_t old = features_.size();
    const int share = (options_.features + cells - 1) / cells;
    for (const auto& [response, at] : corners_) {
      if (std::ssize(features_) == options_.features) break;
      if (taken_.at<unsigned char>(at) != 0 || count[cell_of(at)] >= share) continue;
      take(at);
      features_.push_back({next_id_++, cv::Point2f(at), {}});
    }
    from_.clear();
    for (std::size_t i = old; i < features_.size(); ++i) from_.push_back(features_[i].at);
    if (from_.empty()) return;
    const int reach = options_.corner_px;
    cv::cornerSubPix(image, from_, cv::Size(reach, reach), cv::Size(-1, -1), kStop);
    const cv::Size window(options_.window_px, options_.window_px);
    for (std::size_t i = old; i < features_.size(); ++i) {
      features_[i].at = from_[i - old];
      cv::getRectSubPix(image, window, features_[i].at, features_[i].found);
    }
  }

  /// Correlation of the patch at `at` with one that was found before, in [-1, 1]; 0 where one
  /// of them is of one grey.
  double Similarity(const cv::Mat& image, cv::Point2f at, const cv::Mat& found) {
    cv::getRectSubPix(image, found.size(), at, patch_);
    std::int64_t a = 0, b = 0, aa = 0, bb = 0, ab = 0;
    for (int y = 0; y < found.rows; ++y) {
      const unsigned char* const now = patch_.ptr(y);
      const unsigned char* const then = found.ptr(y);
      int row_a = 0, row_b = 0, row_aa = 0, row_bb = 0, row_ab = 0;  // at most 101 * 255^2
      for (int x = 0; x < found.cols; ++x) {
        const int p = now[x], q = then[x];
        row_a += p;
        row_b += q;
        row_aa += p * p;
        row_bb += q * q;
        row_ab += p * q;
      }
      a += row_a;
      b += row_b;
      aa += row_aa;
      bb += row_bb;
      ab += row_ab;
    }
    const auto n = static_cast<std::int64_t>(found.total());
    const auto variances =
        static_cast<double>(n * aa - a * a) * static_cast<double>(n * bb - b * b);
    return variances > 0.0 ? static_cast<double>(n * ab - a * b) / std::sqrt(variances) : 0.0;
  }

  inline static const cv::TermCriteria kStop{cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 30,
                                             0.01};

  TrackerOptions options_;
  std::vector<Feature> features_;
  std::int64_t next_id_ = 0;
  std::vector<cv::Mat> before_, pyramid_;  ///< of the image before; of this one

  // Memory.
  std::vector<cv::Point2f> from_, to_, back_;
  std::vector<unsigned char> found_, found_back_;
  std::vector<float> error_;
  std::vector<std::pair<float, cv::Point>> corners_;
  cv::Mat taken_, response_, largest_, patch_;
};

}  // namespace alidade
