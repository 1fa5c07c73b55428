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

/// Position at which a filter expects a feature in an image: a Gaussian with the covariance s.
struct ExpectedPoint {
  cv::Point2f position;
  cv::Matx22d s;  ///< covariance of the position, px^2

  /// Returns the standard deviation along the major axis of the covariance ellipse.
  double LargestSigma() const {
    const double mean = 0.5 * (s(0, 0) + s(1, 1)), half = 0.5 * (s(0, 0) - s(1, 1));
    return std::sqrt(mean + std::hypot(half, s(0, 1)));
  }
  double SquaredMahalanobis(cv::Point2f point) const {
    const cv::Vec2d offset(point.x - position.x, point.y - position.y);
    return offset.dot(s.inv() * offset);
  }
};

/// Tracker of corners from image to image. It finds new corners [Shi1994] in grid cells that
/// contain fewer than their share of all features. Each feature is aligned with its patch at the
/// first detection (FoundPatch), starting from
///
///   the expected position  if its 3.7-sigma ellipse is small, and the feature is found there
///                          [Davison2007]
///   optical flow           otherwise; PyramidFlow starts from the expected or the last position
///
/// A feature is lost in these cases:
///   - Its patch leaves the image, or no longer looks as it did at the first detection.
///   - It is closer to an older feature than half of the minimum distance.
///   - Its ellipse is not small, and tracking backward does not return to its last position
///     [Kalal2010].
///   - It is outside its ellipse. This case is ignored if it applies to more than half of the
///     expected features that were found, because the filter is then wrong.
/// If less than a quarter of the features is found, all expectations are ignored. If more than
/// three quarters of the features are lost at once, all features are lost. A feature keeps its id
/// as long as it is tracked. Ids are not reused.
///
/// If features are missing, each image is searched for new corners, in as many rows of cells as the
/// missing features fill.
class FeatureTracker {
 public:
  struct Feature {
    std::int64_t id;
    cv::Point2f position;  ///< position, px; the centre of the upper left pixel is (0, 0)
    FoundPatch patch;      ///< patch about the position
  };
  /// Expected positions in the order of the features; nullopt for a feature without an expectation.
  /// The list is empty if no feature has an expectation.
  using Expectations = std::vector<std::optional<ExpectedPoint>>;

  explicit FeatureTracker(const TrackerOptions& options)
      : options_(options), flow_(options.window_px, options.levels), finder_(options) {}

  /// Adds points that are tracked from the next image on, in addition to corners. These points have
  /// the first ids.
  void Add(const std::vector<cv::Point2f>& points) { added_points_ = points; }
  /// Returns the minimum distance of a tracked point from the rim of an image, px.
  int margin() const { return options_.margin(); }
  int window_px() const { return options_.window_px; }
  /// Returns the features of the last image, ordered by id.
  const std::vector<Feature>& features() const { return features_; }

  /// Tracks the features in the next image, and returns them ordered by id. All images are 8-bit
  /// grey and have the same size.
  const std::vector<Feature>& Track(const cv::Mat& image, const Expectations& expected = {}) {
    flow_.SetNextImage(image);
    if (!features_.empty()) TrackFeatures(image, expected);
    if (std::ssize(features_) < options_.features || !added_points_.empty()) Refill(image);
    return features_;
  }

 private:
  void TrackFeatures(const cv::Mat& image, const Expectations& expected) {
    const std::size_t size = features_.size();
    expected_ = expected;
    expected_.resize(size);
    positions_.assign(size, {});
    is_found_.assign(size, 0);
    for (std::size_t i = 0; i < size; ++i) {
      if (!HasSmallEllipse(i)) continue;
      positions_[i] = expected_[i]->position;
      is_found_[i] = static_cast<unsigned char>(Align(features_[i], image, positions_[i]));
    }
    TrackByFlow(image);
    CheckExpected();
    if (!expected.empty() && 4 * std::ranges::count(is_found_, 1) < std::ssize(is_found_)) {
      expected_.assign(size, std::nullopt);
      TrackByFlow(image);
    }
    RemoveLost(image.size());
  }

  /// Returns true if feature i has an expected position with a small ellipse.
  bool HasSmallEllipse(std::size_t i) const {
    return expected_[i] && 4.0 * kMaxSigmas * expected_[i]->LargestSigma() <= options_.window_px;
  }

  bool Align(Feature& feature, const cv::Mat& image, cv::Point2f& position) const {
    return feature.patch.Align(image, static_cast<float>(options_.least_similarity), position);
  }

  /// Tracks by optical flow the features that have not been found yet.
  void TrackByFlow(const cv::Mat& image) {
    remaining_.clear();
    flow_start_.clear();
    flow_end_.clear();
    for (std::size_t i = 0; i < features_.size(); ++i) {
      if (is_found_[i] != 0) continue;
      remaining_.push_back(i);
      flow_start_.push_back(features_[i].position);
      flow_end_.push_back(expected_[i] ? expected_[i]->position : features_[i].position);
    }
    if (remaining_.empty()) return;
    flow_.TrackForward(flow_start_, flow_end_, flow_found_);
    std::size_t unsure_count = 0;
    for (std::size_t k = 0; k < remaining_.size(); ++k) {
      const std::size_t i = remaining_[k];
      positions_[i] = flow_end_[k];
      if (flow_found_[k] == 0 || !Align(features_[i], image, positions_[i])) continue;
      is_found_[i] = 1;
      if (!HasSmallEllipse(i)) remaining_[unsure_count++] = i;
    }
    remaining_.resize(unsure_count);
    if (remaining_.empty()) return;
    flow_start_.clear();
    flow_end_.clear();
    for (const std::size_t i : remaining_) {
      flow_start_.push_back(positions_[i]);
      flow_end_.push_back(features_[i].position);
    }
    flow_return_ = flow_end_;
    flow_.TrackBackward(flow_start_, flow_return_, flow_found_);
    for (std::size_t k = 0; k < remaining_.size(); ++k) {
      const bool is_back = flow_found_[k] != 0 &&
                           cv::norm(flow_return_[k] - flow_end_[k]) <= options_.forward_backward_px;
      is_found_[remaining_[k]] = static_cast<unsigned char>(is_back);
    }
  }

  /// Rejects features outside their ellipses.
  void CheckExpected() {
    std::size_t expected_count = 0;
    remaining_.clear();
    for (std::size_t i = 0; i < features_.size(); ++i) {
      if (is_found_[i] == 0 || !expected_[i]) continue;
      ++expected_count;
      if (!(expected_[i]->SquaredMahalanobis(positions_[i]) <= kMaxSigmas * kMaxSigmas))
        remaining_.push_back(i);
    }
    if (2 * remaining_.size() > expected_count) return;
    for (const std::size_t i : remaining_) is_found_[i] = 0;
  }

  /// Removes features that were not found, are near the rim of an image of `size`, or are too close
  /// to another feature.
  void RemoveLost(cv::Size size) {
    const int half = options_.window_px / 2;
    const auto margin = static_cast<float>(half);
    const cv::Rect2f inside(margin, margin, static_cast<float>(size.width - 1) - 2.0F * margin,
                            static_cast<float>(size.height - 1) - 2.0F * margin);
    is_occupied_.create(size, CV_8UC1);
    is_occupied_.setTo(0);
    std::size_t kept_count = 0;
    for (std::size_t i = 0; i < features_.size(); ++i) {
      const cv::Point2f position = positions_[i];
      if (is_found_[i] == 0 || !inside.contains(position) ||
          is_occupied_.at<unsigned char>(cv::Point(position)) != 0) {
        continue;
      }
      cv::circle(is_occupied_, cv::Point(position), static_cast<int>(options_.distance_px / 2.0), 1,
                 cv::FILLED);
      Feature& feature = features_[i];
      feature.position = position;
      std::swap(features_[kept_count++], feature);
    }
    // In an unrelated image a few features are still found, at patches that look similar.
    if (4 * kept_count < features_.size()) kept_count = 0;
    features_.resize(kept_count);
  }

  /// Adds the strongest corners of each cell that contains fewer features than its share.
  void Refill(const cv::Mat& image) {
    is_occupied_.create(image.size(), CV_8UC1);
    is_occupied_.setTo(0);
    const int cells = options_.cells[0] * options_.cells[1];
    std::vector<int> count(static_cast<std::size_t>(cells), 0);
    const auto cell_of = [&](cv::Point point) {
      const auto column = static_cast<std::size_t>(point.x * options_.cells[0] / image.cols);
      const auto row = static_cast<std::size_t>(point.y * options_.cells[1] / image.rows);
      return row * static_cast<std::size_t>(options_.cells[0]) + column;
    };
    const auto occupy = [&](cv::Point point) {
      cv::circle(is_occupied_, point, static_cast<int>(options_.distance_px), 1, cv::FILLED);
      ++count[cell_of(point)];
    };
    const auto add = [&](cv::Point2f point) {
      features_.push_back({next_id_++, point, FoundPatch(image, point, options_.window_px | 1)});
    };
    for (const Feature& feature : features_) occupy(cv::Point(feature.position));
    for (const cv::Point2f point : std::exchange(added_points_, {})) {
      occupy(cv::Point(point));
      add(point);
    }
    const int share = (options_.features + cells - 1) / cells;
    const int missing = options_.features - static_cast<int>(features_.size());
    if (missing <= 0) return;
    for (const auto& [response, corner] : finder_.Find(image, missing)) {
      if (std::ssize(features_) == options_.features) break;
      if (is_occupied_.at<unsigned char>(corner) != 0 || count[cell_of(corner)] >= share) continue;
      const cv::Point2f stable = StablePoint(image, options_, cv::Point2f(corner));
      // The stable point may belong to another corner.
      if (is_occupied_.at<unsigned char>(cv::Point(stable)) != 0) continue;
      occupy(cv::Point(stable));
      add(stable);
    }
  }

  /// Size, in sigmas, of an ellipse that contains 99.9 % of a Gaussian: chi2(2) = 13.8.
  static constexpr double kMaxSigmas = 3.717;

  TrackerOptions options_;
  PyramidFlow flow_;
  CornerFinder finder_;
  std::vector<Feature> features_;
  std::vector<cv::Point2f> added_points_;  ///< points to track from the next image on
  std::int64_t next_id_ = 0;

  // Buffers: members, so that their memory is reused.
  Expectations expected_;
  std::vector<cv::Point2f> positions_;  ///< position of each feature, if is_found_
  std::vector<unsigned char> is_found_;
  std::vector<std::size_t> remaining_;
  std::vector<cv::Point2f> flow_start_, flow_end_, flow_return_;
  std::vector<unsigned char> flow_found_;
  cv::Mat is_occupied_;
};

}  // namespace alidade
