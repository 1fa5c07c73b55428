// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <vector>

#include "motion_blur.h"
#include "target_template.h"

/// Search for a target that cannot be tracked. The templates of the target and the image are
/// shrunk, and correlated at each position. One position always has the largest correlation. This
/// position is a match only if its correlation is clearly larger than those at other positions.
namespace alidade {

/// Target that was found: the outline of the template at the position of the match, and the blur
/// that fits best.
struct TargetMatch {
  Corners outline;
  MotionBlur blur;
};

/// Maximum of the correlations.
struct Peak {
  double score = -1.0;
  double lead = 0.0;  ///< score - best score at least half a template away
  cv::Point position;
};

/// Returns the peak of `scores` for a template of `size`, among the positions `allowed`. If
/// `allowed` is empty, all positions are allowed.
inline Peak PeakOf(const cv::Mat& scores, cv::Size size, const cv::Mat& allowed = {}) {
  Peak peak;
  cv::minMaxLoc(scores, nullptr, &peak.score, nullptr, &peak.position, allowed);
  cv::Mat remaining(scores.size(), CV_8U, cv::Scalar(255));
  const cv::Point half(size.width / 2, size.height / 2);
  cv::rectangle(remaining, peak.position - half, peak.position + half, 0, cv::FILLED);
  double next = -1.0;
  if (cv::countNonZero(remaining) > 0)
    cv::minMaxLoc(scores, nullptr, &next, nullptr, nullptr, remaining);
  peak.lead = peak.score - next;
  return peak;
}

constexpr double kMinLead = 0.1;
constexpr double kMaxScore = 1.0 + 1e-3;  ///< larger scores are rounding errors in uniform areas

/// Shrunk template, and the shrunk image about the expected position of the template.
class LocalView {
 public:
  LocalView(const TargetTemplate& target_template, const cv::Mat& grey, const Corners& start)
      : template_(target_template),
        to_image_(target_template.WarpTo(start)),
        middle_(Middle(target_template.patch())) {
    constexpr double kSide = 24.0;  // px
    const cv::Size full_size = target_template.patch().size();
    shrink_ = std::min(1.0, kSide / std::max(full_size.width, full_size.height));
    small_ = {cvRound(full_size.width * shrink_), cvRound(full_size.height * shrink_)};
    const double per_pixel = std::sqrt(AreaScaleAt(to_image_, middle_)) / shrink_;
    cv::GaussianBlur(grey, smooth_, {}, std::max(0.3, 0.4 * per_pixel));
  }

  cv::Size size() const { return small_; }
  cv::Mat ShrunkTemplate(const MotionBlur& blur) const {
    cv::Mat shrunk_template;
    cv::resize(template_.Blurred(blur), shrunk_template, small_, 0, 0, cv::INTER_AREA);
    return shrunk_template;
  }
  /// Returns the search area for a target that is `growth` times as large as at the start. In this
  /// area the target has the size of ShrunkTemplate(). The area has a margin of this size on each
  /// side.
  cv::Mat SearchArea(double growth) const {
    // This warp converts pixels of the shrunk patch to pixels of the patch, which grows about its
    // middle.
    const double k = growth / shrink_, offset = 0.5 / shrink_ - 0.5;
    const cv::Matx33d from_small(k, 0, growth * (offset - middle_.x) + middle_.x, 0, k,
                                 growth * (offset - middle_.y) + middle_.y, 0, 0, 1);
    const cv::Matx33d from_area(1, 0, -small_.width, 0, 1, -small_.height, 0, 0, 1);
    cv::Mat search_area;
    cv::warpPerspective(smooth_, search_area, to_image_ * from_small * from_area,
                        cv::Size(3 * small_.width, 3 * small_.height),
                        cv::INTER_LINEAR | cv::WARP_INVERSE_MAP, cv::BORDER_CONSTANT, 128.0);
    return search_area;
  }
  /// Returns the shift, px of the patch, from the start to a position in SearchArea().
  cv::Point2d Shift(cv::Point position, double growth) const {
    return growth / shrink_ * (cv::Point2d(position) - cv::Point2d(small_.width, small_.height));
  }
  Corners Outline(cv::Point position, double growth) const {
    const cv::Point2d shift = middle_ * (1.0 - growth) + Shift(position, growth);
    return ApplyToCorners(to_image_ * cv::Matx33d(growth, 0, shift.x, 0, growth, shift.y, 0, 0, 1),
                          template_.corners());
  }
  /// Returns the mask of the positions that a target with this blur can have reached from the
  /// outline `previous`.
  cv::Mat AllowedPositions(const MotionBlur& blur, double growth, const Corners& previous) const {
    cv::Mat allowed(2 * small_.height + 1, 2 * small_.width + 1, CV_8U);
    const cv::Point2d start_offset = middle_ - Apply(to_image_.inv(), MiddleOf(previous));
    for (int y = 0; y < allowed.rows; ++y) {
      for (int x = 0; x < allowed.cols; ++x) {
        const bool fits =
            blur.Explains(start_offset + Shift({x, y}, growth), template_.patch().size());
        allowed.at<unsigned char>(y, x) = fits ? 255 : 0;
      }
    }
    return allowed;
  }

 private:
  const TargetTemplate& template_;
  cv::Matx33d to_image_;
  cv::Point2d middle_;
  double shrink_ = 1.0;
  cv::Size small_;
  cv::Mat smooth_;
};

/// Searches for the target about `start`, up to the size of the target in each direction. The
/// target must have about the same size and rotation, and may be blurred. The blur must fit the
/// motion from `previous`, the outline in the last image. Without this condition a blurred
/// template, which has little texture, would match many areas.
inline std::optional<TargetMatch> FindNearby(const std::vector<const TargetTemplate*>& templates,
                                             const cv::Mat& grey, const Corners& start,
                                             const Corners& previous) {
  constexpr double kMinScore = 0.8, kGrowth = 1.1;
  constexpr int kMinSide = 6;  // px
  std::optional<TargetMatch> found;
  Peak best;
  for (const TargetTemplate* target_template : templates) {
    const LocalView view(*target_template, grey, start);
    if (std::min(view.size().width, view.size().height) < kMinSide) continue;
    for (const MotionBlur& blur : MotionBlur::Candidates()) {
      const cv::Mat shrunk_template = view.ShrunkTemplate(blur);
      for (const double growth : {1.0 / kGrowth, 1.0, kGrowth}) {
        const cv::Mat allowed = view.AllowedPositions(blur, growth, previous);
        if (cv::countNonZero(allowed) == 0) continue;
        cv::Mat scores;
        cv::matchTemplate(view.SearchArea(growth), shrunk_template, scores, cv::TM_CCOEFF_NORMED);
        const Peak peak = PeakOf(scores, shrunk_template.size(), allowed);
        if (peak.score <= best.score || peak.score > kMaxScore) continue;
        best = peak;
        found = TargetMatch{view.Outline(peak.position, growth), blur};
      }
    }
  }
  return best.score >= kMinScore && best.lead >= kMinLead ? found : std::nullopt;
}

/// Searches the whole image for the upright target, at half to twice the size of `last`.
inline std::optional<Corners> FindAnywhere(const std::vector<TargetTemplate>& templates,
                                           const cv::Mat& grey, const Corners& last,
                                           double min_score) {
  constexpr double kSide = 40.0, kGrowth = 2.0;         // px of the shrunk template
  constexpr double kMinSide = 6.0, kMinVisible = 12.0;  // minimum sides, px
  std::optional<Corners> best;
  double best_score = min_score;
  for (const TargetTemplate& target_template : templates) {
    const cv::Mat& patch = target_template.patch();
    const double previous_size = std::sqrt(AreaOf(last) / patch.size().area());
    for (double growth = 1.0 / kGrowth; growth < kGrowth * 1.01;
         growth *= std::sqrt(std::sqrt(kGrowth))) {
      const double size = previous_size * growth;  // image pixels per template pixel
      const double shrink = std::min(1.0, kSide / (size * std::max(patch.cols, patch.rows)));
      const double side = std::min(patch.cols, patch.rows) * size;
      if (!(side >= kMinVisible && side * shrink >= kMinSide)) continue;
      if (std::min(grey.cols, grey.rows) * shrink < kMinSide) continue;
      cv::Mat small, shrunk_template, scores;
      cv::resize(grey, small, {}, shrink, shrink, cv::INTER_AREA);
      cv::resize(patch, shrunk_template, {}, size * shrink, size * shrink, cv::INTER_AREA);
      if (shrunk_template.cols > small.cols || shrunk_template.rows > small.rows) continue;
      cv::matchTemplate(small, shrunk_template, scores, cv::TM_CCOEFF_NORMED);
      const Peak peak = PeakOf(scores, shrunk_template.size());
      if (!(peak.score > best_score) || peak.score > kMaxScore || peak.lead < kMinLead) continue;
      best_score = peak.score;
      const cv::Matx33d warp(size, 0, peak.position.x / shrink, 0, size, peak.position.y / shrink,
                             0, 0, 1);
      best = ApplyToCorners(warp, target_template.corners());
    }
  }
  return best;
}

}  // namespace alidade
