// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "corner_finder.h"
#include "found_patch.h"
#include "pyramid_flow.h"
#include "tracker_options.h"

namespace alidade {

/// Where a filter expects a feature in an image: a Gaussian, px.
struct ExpectedPoint {
  cv::Point2f at;
  cv::Matx22d s;  ///< px^2

  /// Standard deviation along the longer axis of its ellipse.
  double LargestSigma() const {
    const double mean = 0.5 * (s(0, 0) + s(1, 1)), half = 0.5 * (s(0, 0) - s(1, 1));
    return std::sqrt(mean + std::hypot(half, s(0, 1)));
  }
  double SquaredMahalanobis(cv::Point2f point) const {
    const cv::Vec2d off(point.x - at.x, point.y - at.y);
    return off.dot(s.inv() * off);
  }
};

/// Follows corners from image to image, and finds new ones [Shi1994] where a cell of the grid has
/// fewer than its share. Each is aligned with the patch where it was found (FoundPatch), from
///
///   where it is expected   if its ellipse is small and it is found there [Davison2007]
///   optical flow           else (PyramidFlow), begun where it is expected, or was
///
/// It is lost where its patch leaves the image, where it no longer looks as it did when it was
/// found, and where it comes as close to an older one as half of the least distance; if its ellipse
/// is not small, where it is not followed back to where it was [Kalal2010]; outside its ellipse,
/// but for when more than half of those found are: then it is the filter that is wrong. Where
/// fewer than a quarter are found by what is expected, nothing is. Where more than three quarters
/// are lost at once, all are. It keeps its id as long as it lives, and no other has it.
///
/// Where features are missing, as many rows of cells as they fill are searched for corners in each
/// image.
class FeatureTracker {
 public:
  struct Feature {
    std::int64_t id;
    cv::Point2f at;    ///< px; the centre of the upper left pixel is (0, 0)
    FoundPatch found;  ///< what is about it
  };
  /// Of each feature, in their order, where it is known; empty: of none.
  using Expectations = std::vector<std::optional<ExpectedPoint>>;

  explicit FeatureTracker(const TrackerOptions& options)
      : options_(options), flow_(options.window_px, options.levels), finder_(options) {}

  /// Points of the next image that are followed beside the corners that are found: the first ids.
  void Add(const std::vector<cv::Point2f>& points) { given_ = points; }
  /// How far from the rim of an image a point is that can be followed, px.
  int margin() const { return options_.margin(); }
  int window_px() const { return options_.window_px; }
  /// Those of the last image, by id.
  const std::vector<Feature>& features() const { return features_; }

  /// The features in the next image, by id. All images are of one size, 8 bit grey.
  const std::vector<Feature>& Track(const cv::Mat& image, const Expectations& expected = {}) {
    flow_.Take(image);
    if (!features_.empty()) Follow(image, expected);
    if (std::ssize(features_) < options_.features || !given_.empty()) Refill(image);
    return features_;
  }

 private:
  void Follow(const cv::Mat& image, const Expectations& expected) {
    const std::size_t size = features_.size();
    expected_ = expected;
    expected_.resize(size);
    to_.assign(size, {});
    found_.assign(size, 0);
    for (std::size_t i = 0; i < size; ++i) {
      if (!IsSure(i)) continue;
      to_[i] = expected_[i]->at;
      found_[i] = static_cast<unsigned char>(Align(features_[i], image, to_[i]));
    }
    FollowFlow(image);
    CheckExpected();
    if (!expected.empty() && 4 * std::ranges::count(found_, 1) < std::ssize(found_)) {
      expected_.assign(size, std::nullopt);
      FollowFlow(image);
    }
    Keep(image.size());
  }

  /// Expected within a small ellipse.
  bool IsSure(std::size_t i) const {
    return expected_[i] && 4.0 * kFarthest * expected_[i]->LargestSigma() <= options_.window_px;
  }

  bool Align(Feature& feature, const cv::Mat& image, cv::Point2f& at) const {
    return feature.found.Align(image, static_cast<float>(options_.least_similarity), at);
  }

  /// By optical flow, those that are not found yet.
  void FollowFlow(const cv::Mat& image) {
    rest_.clear();
    from_.clear();
    flowed_.clear();
    for (std::size_t i = 0; i < features_.size(); ++i) {
      if (found_[i] != 0) continue;
      rest_.push_back(i);
      from_.push_back(features_[i].at);
      flowed_.push_back(expected_[i] ? expected_[i]->at : features_[i].at);
    }
    if (rest_.empty()) return;
    flow_.Forward(from_, flowed_, flow_found_);
    std::size_t unsure = 0;
    for (std::size_t k = 0; k < rest_.size(); ++k) {
      const std::size_t i = rest_[k];
      to_[i] = flowed_[k];
      if (flow_found_[k] == 0 || !Align(features_[i], image, to_[i])) continue;
      found_[i] = 1;
      if (!IsSure(i)) rest_[unsure++] = i;
    }
    rest_.resize(unsure);
    if (rest_.empty()) return;
    from_.clear();
    flowed_.clear();
    for (const std::size_t i : rest_) {
      from_.push_back(to_[i]);
      flowed_.push_back(features_[i].at);
    }
    back_ = flowed_;
    flow_.Back(from_, back_, flow_found_);
    for (std::size_t k = 0; k < rest_.size(); ++k) {
      const bool is_back =
          flow_found_[k] != 0 && cv::norm(back_[k] - flowed_[k]) <= options_.forward_backward_px;
      found_[rest_[k]] = static_cast<unsigned char>(is_back);
    }
  }

  /// Refuses what lies outside its ellipse.
  void CheckExpected() {
    std::size_t known = 0;
    rest_.clear();
    for (std::size_t i = 0; i < features_.size(); ++i) {
      if (found_[i] == 0 || !expected_[i]) continue;
      ++known;
      if (!(expected_[i]->SquaredMahalanobis(to_[i]) <= kFarthest * kFarthest)) rest_.push_back(i);
    }
    if (2 * rest_.size() > known) return;
    for (const std::size_t i : rest_) found_[i] = 0;
  }

  /// Those that were found, on an image of that size, and are not too close to one another.
  void Keep(cv::Size size) {
    const int half = options_.window_px / 2;
    const auto margin = static_cast<float>(half);
    const cv::Rect2f inside(margin, margin, static_cast<float>(size.width - 1) - 2.0F * margin,
                            static_cast<float>(size.height - 1) - 2.0F * margin);
    taken_.create(size, CV_8UC1);
    taken_.setTo(0);
    std::size_t kept = 0;
    for (std::size_t i = 0; i < features_.size(); ++i) {
      const cv::Point2f at = to_[i];
      if (found_[i] == 0 || !inside.contains(at) || taken_.at<unsigned char>(cv::Point(at)) != 0) {
        continue;
      }
      cv::circle(taken_, cv::Point(at), static_cast<int>(options_.distance_px / 2.0), 1,
                 cv::FILLED);
      Feature& feature = features_[i];
      feature.at = at;
      std::swap(features_[kept++], feature);
    }
    // Of an image that has nothing to do with the one before, some are found at what looks alike.
    if (4 * kept < features_.size()) kept = 0;
    features_.resize(kept);
  }

  /// The strongest corners of each cell that has fewer features than its share.
  void Refill(const cv::Mat& image) {
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
    const auto add = [&](cv::Point2f at) {
      features_.push_back({next_id_++, at, FoundPatch(image, at, options_.window_px | 1)});
    };
    for (const Feature& feature : features_) take(cv::Point(feature.at));
    for (const cv::Point2f at : std::exchange(given_, {})) {
      take(cv::Point(at));
      add(at);
    }
    const int share = (options_.features + cells - 1) / cells;
    const int missing = options_.features - static_cast<int>(features_.size());
    if (missing <= 0) return;
    for (const auto& [response, at] : finder_.Find(image, missing)) {
      if (std::ssize(features_) == options_.features) break;
      if (taken_.at<unsigned char>(at) != 0 || count[cell_of(at)] >= share) continue;
      const cv::Point2f stable = StablePoint(image, options_, cv::Point2f(at));
      if (taken_.at<unsigned char>(cv::Point(stable)) != 0) continue;  // that of another corner
      take(cv::Point(stable));
      add(stable);
    }
  }

  /// Sigmas of an ellipse with all but a thousandth of a Gaussian: of chi2(2) it is 13.8.
  static constexpr double kFarthest = 3.717;

  TrackerOptions options_;
  PyramidFlow flow_;
  CornerFinder finder_;
  std::vector<Feature> features_;
  std::vector<cv::Point2f> given_;  ///< to be followed from the next image on
  std::int64_t next_id_ = 0;

  // Memory.
  Expectations expected_;
  std::vector<cv::Point2f> to_;  ///< by feature: where it is, if found_
  std::vector<unsigned char> found_;
  std::vector<std::size_t> rest_;
  std::vector<cv::Point2f> from_, flowed_, back_;
  std::vector<unsigned char> flow_found_;
  cv::Mat taken_;
};

}  // namespace alidade
