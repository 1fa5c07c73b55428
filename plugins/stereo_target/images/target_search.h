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

/// A target that cannot be followed is looked for by the correlation of its templates with an image
/// at each place, both small. Something is always most alike: the best place counts only where it
/// is clearly better than all others.
namespace alidade {

/// Where a target was found, as large as a template there, and the blur it fits best with.
struct TargetMatch {
  Corners outline;
  MotionBlur blur;
};

/// The largest of correlations.
struct Peak {
  double score = -1.0;
  double lead = 0.0;  ///< over those at least half a template away
  cv::Point at;
};

/// Among the places `allowed`, empty: all; of a template of `size`.
inline Peak PeakOf(const cv::Mat& scores, cv::Size size, const cv::Mat& allowed = {}) {
  Peak peak;
  cv::minMaxLoc(scores, nullptr, &peak.score, nullptr, &peak.at, allowed);
  cv::Mat others(scores.size(), CV_8U, cv::Scalar(255));
  const cv::Point half(size.width / 2, size.height / 2);
  cv::rectangle(others, peak.at - half, peak.at + half, 0, cv::FILLED);
  double next = -1.0;
  if (cv::countNonZero(others) > 0) cv::minMaxLoc(scores, nullptr, &next, nullptr, nullptr, others);
  peak.lead = peak.score - next;
  return peak;
}

constexpr double kMinLead = 0.1;
constexpr double kMaxScore = 1.0 + 1e-3;  ///< more is rounding, of nothing but one grey

/// A template and the image about where it should be, both shrunk.
class NearView {
 public:
  NearView(const TargetTemplate& one, const cv::Mat& grey, const Corners& start)
      : one_(one), to_image_(one.To(start)), middle_(Middle(one.patch())) {
    constexpr double kSide = 24.0;  // px
    const cv::Size whole = one.patch().size();
    shrink_ = std::min(1.0, kSide / std::max(whole.width, whole.height));
    small_ = {cvRound(whole.width * shrink_), cvRound(whole.height * shrink_)};
    const double per_pixel = std::sqrt(AreaAt(to_image_, middle_)) / shrink_;
    cv::GaussianBlur(grey, smooth_, {}, std::max(0.3, 0.4 * per_pixel));
  }

  cv::Size size() const { return small_; }
  cv::Mat Look(const MotionBlur& blur) const {
    cv::Mat look;
    cv::resize(one_.Blurred(blur), look, small_, 0, 0, cv::INTER_AREA);
    return look;
  }
  /// The target `grown` times as large as at the start has the size of Look() in it; there is as
  /// much to each side.
  cv::Mat Area(double grown) const {
    // From pixels of the shrunk patch to those of the patch, which grows about its middle.
    const double k = grown / shrink_, offset = 0.5 / shrink_ - 0.5;
    const cv::Matx33d from_small(k, 0, grown * (offset - middle_.x) + middle_.x, 0, k,
                                 grown * (offset - middle_.y) + middle_.y, 0, 0, 1);
    const cv::Matx33d from_area(1, 0, -small_.width, 0, 1, -small_.height, 0, 0, 1);
    cv::Mat area;
    cv::warpPerspective(smooth_, area, to_image_ * from_small * from_area,
                        cv::Size(3 * small_.width, 3 * small_.height),
                        cv::INTER_LINEAR | cv::WARP_INVERSE_MAP, cv::BORDER_CONSTANT, 128.0);
    return area;
  }
  /// Shift from the start of what is at a place of Area(), px of the patch.
  cv::Point2d Shift(cv::Point at, double grown) const {
    return grown / shrink_ * (cv::Point2d(at) - cv::Point2d(small_.width, small_.height));
  }
  Corners Outline(cv::Point at, double grown) const {
    const cv::Point2d to = middle_ * (1.0 - grown) + Shift(at, grown);
    return Moved(to_image_ * cv::Matx33d(grown, 0, to.x, 0, grown, to.y, 0, 0, 1), one_.corners());
  }
  /// The places that a target with that blur can have come to from `before`, an outline.
  cv::Mat Allowed(const MotionBlur& blur, double grown, const Corners& before) const {
    cv::Mat allowed(2 * small_.height + 1, 2 * small_.width + 1, CV_8U);
    const cv::Point2d moved = middle_ - Apply(to_image_.inv(), MiddleOf(before));
    for (int y = 0; y < allowed.rows; ++y) {
      for (int x = 0; x < allowed.cols; ++x) {
        const bool fits = blur.Explains(moved + Shift({x, y}, grown), one_.patch().size());
        allowed.at<unsigned char>(y, x) = fits ? 255 : 0;
      }
    }
    return allowed;
  }

 private:
  const TargetTemplate& one_;
  cv::Matx33d to_image_;
  cv::Point2d middle_;
  double shrink_ = 1.0;
  cv::Size small_;
  cv::Mat smooth_;
};

/// About `start`, by its own size to each side, as large and turned as there or nearly, sharp or
/// blurred. The blur has to be that of the motion from `before`, where it was in the last image:
/// a blurred template has little texture, and fits much.
inline std::optional<TargetMatch> FindNear(const std::vector<const TargetTemplate*>& templates,
                                           const cv::Mat& grey, const Corners& start,
                                           const Corners& before) {
  constexpr double kMinScore = 0.8, kGrown = 1.1;
  constexpr int kMinSide = 6;  // px
  std::optional<TargetMatch> found;
  Peak best;
  for (const TargetTemplate* one : templates) {
    const NearView view(*one, grey, start);
    if (std::min(view.size().width, view.size().height) < kMinSide) continue;
    for (const MotionBlur& blur : MotionBlur::Candidates()) {
      const cv::Mat look = view.Look(blur);
      for (const double grown : {1.0 / kGrown, 1.0, kGrown}) {
        const cv::Mat allowed = view.Allowed(blur, grown, before);
        if (cv::countNonZero(allowed) == 0) continue;
        cv::Mat scores;
        cv::matchTemplate(view.Area(grown), look, scores, cv::TM_CCOEFF_NORMED);
        const Peak peak = PeakOf(scores, look.size(), allowed);
        if (peak.score <= best.score || peak.score > kMaxScore) continue;
        best = peak;
        found = TargetMatch{view.Outline(peak.at, grown), blur};
      }
    }
  }
  return best.score >= kMinScore && best.lead >= kMinLead ? found : std::nullopt;
}

/// Anywhere in the image, upright, half to twice as large as `last`.
inline std::optional<Corners> FindAnywhere(const std::vector<TargetTemplate>& templates,
                                           const cv::Mat& grey, const Corners& last,
                                           double min_score) {
  constexpr double kSide = 40.0, kGrown = 2.0;       // px of the template as it is compared
  constexpr double kMinSide = 6.0, kMinSeen = 12.0;  // px, shrunk and in the image
  std::optional<Corners> best;
  double best_score = min_score;
  for (const TargetTemplate& one : templates) {
    const cv::Mat& patch = one.patch();
    const double size_then = std::sqrt(AreaOf(last) / patch.size().area());
    for (double grown = 1.0 / kGrown; grown < kGrown * 1.01;
         grown *= std::sqrt(std::sqrt(kGrown))) {
      const double size = size_then * grown;  // px of the image for one of the template
      const double shrink = std::min(1.0, kSide / (size * std::max(patch.cols, patch.rows)));
      const double side = std::min(patch.cols, patch.rows) * size;
      if (!(side >= kMinSeen && side * shrink >= kMinSide)) continue;
      if (std::min(grey.cols, grey.rows) * shrink < kMinSide) continue;
      cv::Mat small, look, scores;
      cv::resize(grey, small, {}, shrink, shrink, cv::INTER_AREA);
      cv::resize(patch, look, {}, size * shrink, size * shrink, cv::INTER_AREA);
      if (look.cols > small.cols || look.rows > small.rows) continue;
      cv::matchTemplate(small, look, scores, cv::TM_CCOEFF_NORMED);
      const Peak peak = PeakOf(scores, look.size());
      if (!(peak.score > best_score) || peak.score > kMaxScore || peak.lead < kMinLead) continue;
      best_score = peak.score;
      const cv::Matx33d warp(size, 0, peak.at.x / shrink, 0, size, peak.at.y / shrink, 0, 0, 1);
      best = Moved(warp, one.corners());
    }
  }
  return best;
}

}  // namespace alidade
