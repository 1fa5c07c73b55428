// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>
#include <utility>
#include <vector>

#include "alidade/model/params.h"
#include "found_patch.h"

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

/// Follows corners from image to image [Lucas1981], and finds new ones [Shi1994] where a cell of
/// the grid has fewer than its share. A feature is lost where its patch leaves the image, where it
/// is not followed back to where it was [Kalal2010], where it no longer looks as it did when it was
/// found, and where it comes as close to an older one as half of the least distance. Where more
/// than three quarters are lost at once, all are. It keeps its id as long as it lives, and no other
/// has it.
///
/// The search for corners takes longer than following does: where features are missing, a third of
/// the rows of cells is searched in each image, and every row where most were lost at once.
class FeatureTracker {
 public:
  struct Feature {
    std::int64_t id;
    cv::Point2f at;    ///< px; the centre of the upper left pixel is (0, 0)
    FoundPatch found;  ///< what is about it
  };

  explicit FeatureTracker(const TrackerOptions& options) : options_(options) {}

  /// Points of the next image that are followed beside the corners that are found: the first ids.
  void Add(const std::vector<cv::Point2f>& points) { given_ = points; }
  /// How far from the rim of an image a point is that can be followed, px.
  int margin() const { return options_.window_px / 2 + 1; }

  /// The features in the next image, by id. All images are of one size, 8 bit grey.
  const std::vector<Feature>& Track(const cv::Mat& image) {
    const cv::Size window(options_.window_px, options_.window_px);
    // Derivatives that wait in memory are slower than those that are computed where they are used.
    cv::buildOpticalFlowPyramid(image, pyramid_, window, options_.levels, false);
    const std::size_t before = features_.size();
    if (before > 0) Follow(image, window);
    if (std::ssize(features_) < options_.features || !given_.empty()) {
      Refill(image, /*everywhere=*/2 * features_.size() <= before);
    }
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
      if (found_[i] == 0 || found_back_[i] == 0 || !inside.contains(to_[i]) ||
          cv::norm(back_[i] - from_[i]) > options_.forward_backward_px) {
        continue;
      }
      Feature& feature = features_[i];
      cv::Point2f at = to_[i];
      if (!feature.found.Align(image, at)) continue;
      if (!inside.contains(at) || taken_.at<unsigned char>(cv::Point(at)) != 0 ||
          feature.found.Similarity(image, at) < options_.least_similarity) {
        continue;
      }
      cv::circle(taken_, cv::Point(at), static_cast<int>(options_.distance_px / 2.0), 1,
                 cv::FILLED);
      feature.at = at;
      std::swap(features_[kept++], feature);
    }
    // Of an image that has nothing to do with the one before, some are found at what looks alike.
    if (4 * kept < features_.size()) kept = 0;
    features_.resize(kept);
  }

  /// The strongest corners of each cell that has fewer features than its share, of the rows of
  /// cells whose turn it is.
  void Refill(const cv::Mat& image, bool everywhere) {
    const int rows = options_.cells[1];
    strongest_.resize(static_cast<std::size_t>(rows), 0.0);
    corners_.clear();
    if (everywhere) {
      FindCorners(image, 0, rows);
    } else {
      const int last = std::min(rows, turn_ + (rows + 2) / 3);
      FindCorners(image, turn_, last);
      turn_ = last % rows;
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
    for (const cv::Point2f at : std::exchange(given_, {})) {
      take(cv::Point(at));
      features_.push_back({next_id_++, at, FoundPatch(image, at, options_.window_px | 1)});
    }
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
    for (cv::Point2f& at : from_) at = FindPoint(image, at);
    for (std::size_t i = old; i < features_.size(); ++i) {
      features_[i].at = from_[i - old];
      features_[i].found = FoundPatch(image, features_[i].at, options_.window_px | 1);
    }
  }

  /// The point of a patch that stays with it when it grows, turns or is sheared, and not only when
  /// it is shifted [Forstner1987]: p = (sum g g')^-1 sum g g' x, g the gradient at x. A patch about
  /// any other point would be followed to a point that drifts from it.
  cv::Point2f FindPoint(const cv::Mat& image, cv::Point2f at) {
    constexpr int kMost = 5;
    constexpr float kFarthest = 6.0F, kSettled = 0.02F;  // px
    const cv::Point2f start = at;
    const int side = options_.window_px | 1, middle = 1 + side / 2;
    for (int i = 0; i < kMost; ++i) {
      cv::getRectSubPix(image, cv::Size(side + 2, side + 2), at, patch_, CV_32F);
      cv::Matx22d normal = cv::Matx22d::zeros();
      cv::Vec2d right(0.0, 0.0);
      for (int y = 1; y <= side; ++y) {
        for (int x = 1; x <= side; ++x) {
          const double gx = patch_.at<float>(y, x + 1) - patch_.at<float>(y, x - 1);
          const double gy = patch_.at<float>(y + 1, x) - patch_.at<float>(y - 1, x);
          const double along = gx * (x - middle) + gy * (y - middle);
          normal += cv::Matx22d(gx * gx, gx * gy, gx * gy, gy * gy);
          right += along * cv::Vec2d(gx, gy);
        }
      }
      if (!(cv::determinant(normal) > 0.0)) return start;
      const cv::Vec2d shift = normal.inv() * right;
      at += cv::Point2f(static_cast<float>(shift[0]), static_cast<float>(shift[1]));
      const cv::Rect2f inside(static_cast<float>(margin()), static_cast<float>(margin()),
                              static_cast<float>(image.cols - 2 * margin()),
                              static_cast<float>(image.rows - 2 * margin()));
      if (!(cv::norm(at - start) < kFarthest) || !inside.contains(at)) return start;
      if (cv::norm(shift) < kSettled) break;
    }
    return at;
  }

  /// The local maxima of the response in the rows of cells [first, last).
  void FindCorners(const cv::Mat& image, int first, int last) {
    const int rows = options_.cells[1];
    const auto top_of = [&](int row) { return (row * image.rows + rows - 1) / rows; };
    const int reach = options_.corner_px / 2 + 2;  // of the response, its derivatives and maxima
    const int top = std::max(0, top_of(first) - reach);
    const int bottom = std::min(image.rows, top_of(last) + reach);
    cv::cornerMinEigenVal(image.rowRange(top, bottom), response_, options_.corner_px);
    cv::dilate(response_, largest_, cv::Mat());
    const int margin = options_.window_px / 2 + 1;
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

  inline static const cv::TermCriteria kStop{cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 30,
                                             0.01};

  TrackerOptions options_;
  std::vector<Feature> features_;
  std::vector<cv::Point2f> given_;  ///< to be followed from the next image on
  std::int64_t next_id_ = 0;
  std::vector<cv::Mat> before_, pyramid_;  ///< of the image before; of this one
  std::vector<double> strongest_;          ///< response in each row of cells, when it was searched
  int turn_ = 0;                           ///< the row of cells that is searched next

  // Memory.
  std::vector<cv::Point2f> from_, to_, back_;
  std::vector<unsigned char> found_, found_back_;
  std::vector<float> error_;
  std::vector<std::pair<float, cv::Point>> corners_;
  cv::Mat taken_, response_, largest_, patch_;
};

}  // namespace alidade
