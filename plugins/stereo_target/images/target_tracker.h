// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>
#include <optional>
#include <vector>

#include "alidade/model/params.h"
#include "alignment.h"

namespace alidade {

/// How a target is followed.
struct TargetOptions {
  Warp warp;
  double least_similarity;    ///< of the target and its template, for a measurement
  double refresh_similarity;  ///< below it the template is taken anew
  double refresh_scale;       ///< likewise where the target is so many times larger or smaller

  explicit TargetOptions(Params& p)
      : warp(static_cast<Warp>(p.Choice(
            "warp", {"similarity", "affine", "homography"},
            "how the target may change in the image: it moves, turns and grows; or is also "
            "stretched and sheared; or is plane and tilts, which needs `camera` or "
            "`stereo`",
            0))),
        least_similarity(p.Number("least_similarity", "1",
                                  "the target is lost where it correlates less with its template",
                                  {-1.0, 1.0}, 0.7)),
        refresh_similarity(p.Number("refresh_similarity", "1",
                                    "the template is taken anew where it correlates less; each "
                                    "time adds its error to all that follows",
                                    {-1.0, 1.0}, 0.8)),
        refresh_scale(p.Number("refresh_scale", "1",
                               "likewise where the target has become so many times larger or "
                               "smaller",
                               {1.0, 1e3, true, false}, 1.7)) {}
};

/// Follows one target through the images of a camera, and measures its size.
///
/// A grid of its points is followed from the last image [Lucas1981], [Kalal2010], a similarity is
/// put through them, and from there the target is aligned with a template, see Align(): errors do
/// not add up from image to image. The first template is used as long as it fits well, then of it
/// and others that were taken on the way the one that tells most of the size; each brings the error
/// of its own. Where none fits, as in a blurred image, there is no measurement, but the target is
/// followed on for some images; then it is lost, and looked for in the whole image.
class TargetTracker {
 public:
  using Corners = std::array<cv::Point2f, 4>;  ///< clockwise from the upper left

  /// Where the target is, and its size.
  struct Seen {
    cv::Point2d middle;    ///< px, of what was the middle in the first image
    cv::Rect2d box;        ///< px, upright, about all of it
    double inverse_scale;  ///< size in the first image / size now; of a plane: depth now / then
    double variance;       ///< of inverse_scale
  };

  /// `intrinsics`: the camera matrix, for a homography.
  TargetTracker(const TargetOptions& options, const std::optional<cv::Matx33d>& intrinsics)
      : options_(options), intrinsics_(intrinsics) {}

  /// The target in the next image; none where it is not measured. `corners`: where it is said to
  /// be; without them there is none until a first image had them, and texture in them.
  std::optional<Seen> Track(const cv::Mat& image, const std::optional<Corners>& corners) {
    std::optional<Seen> seen;
    image.convertTo(grey_, CV_32F);
    if (corners) {
      const Corners inner = Inset(*corners);
      const bool first = templates_.empty();
      if (first) TakeTemplate(inner, 1.0, 0.0);
      seen = Measure(inner, options_.least_similarity, kGuessedArea);
      lost_ = false;
      if (!seen) outline_ = inner;
      if (first && !seen) templates_.clear();  // without texture it is like nothing
    } else if (!templates_.empty()) {
      if (!lost_) seen = FollowAndMeasure(image);
      if (lost_) seen = SearchAndMeasure();
    }
    unseen_ = seen ? 0 : unseen_ + 1;
    image.copyTo(before_);
    return seen;
  }

  /// Where it is in the last image, also where it was followed but not measured; none: it is lost.
  std::optional<Corners> outline() const {
    if (lost_ || templates_.empty()) return std::nullopt;
    return outline_;
  }

 private:
  static constexpr std::size_t kTemplates = 6;  ///< at most
  static constexpr int kPatience = 10;  ///< images for which it is followed without being measured
  static constexpr double kGuessedArea = 2.0;  ///< times that of a box, or less: as boxes are known

  /// What the target looked like.
  struct Template {
    cv::Mat patch;      ///< grey as float
    cv::Matx33d taken;  ///< where
    double scale;       ///< inverse scale there
    double variance;    ///< of scale, relative: of its square
  };

  /// Leaves out the rim, which mixes with what is behind the target, and would pull the size.
  static Corners Inset(const Corners& corners) {
    constexpr float kShare = 0.04F;
    constexpr float kRest = 1.0F - kShare;
    return Moved(FromUnit(corners),
                 {cv::Point2f(kShare, kShare), {kRest, kShare}, {kRest, kRest}, {kShare, kRest}});
  }

  /// From the unit square, its upper left corner first.
  static cv::Matx33d FromUnit(const Corners& corners) {
    const Corners unit{cv::Point2f(0.0F, 0.0F), {1.0F, 0.0F}, {1.0F, 1.0F}, {0.0F, 1.0F}};
    return cv::getPerspectiveTransform(unit.data(), corners.data());
  }
  static Corners CornersOf(const cv::Mat& patch) {
    const auto right = static_cast<float>(patch.cols - 1);
    const auto bottom = static_cast<float>(patch.rows - 1);
    return {cv::Point2f(0.0F, 0.0F), {right, 0.0F}, {right, bottom}, {0.0F, bottom}};
  }
  static Corners Moved(const cv::Matx33d& warp, const Corners& corners) {
    Corners moved;
    std::ranges::transform(corners, moved.begin(),
                           [&](cv::Point2f at) { return cv::Point2f(Apply(warp, at)); });
    return moved;
  }
  static double AreaOf(const Corners& corners) {
    return cv::contourArea(std::vector<cv::Point2f>(corners.begin(), corners.end()));
  }

  void TakeTemplate(const Corners& outline, double scale, double variance) {
    const float width = 0.5F * static_cast<float>(cv::norm(outline[1] - outline[0]) +
                                                  cv::norm(outline[2] - outline[3]));
    const float height = 0.5F * static_cast<float>(cv::norm(outline[3] - outline[0]) +
                                                   cv::norm(outline[2] - outline[1]));
    const cv::Size size(std::max(8, cvRound(width)), std::max(8, cvRound(height)));
    Template taken{cv::Mat(size, CV_32F), {}, scale, variance};
    taken.taken = cv::getPerspectiveTransform(CornersOf(taken.patch).data(), outline.data());
    cv::warpPerspective(grey_, taken.patch, taken.taken, size,
                        cv::INTER_LINEAR | cv::WARP_INVERSE_MAP, cv::BORDER_REPLICATE);
    if (templates_.size() == kTemplates) templates_.erase(templates_.begin() + 1);
    templates_.push_back(taken);
    last_ = templates_.size() - 1;
    misfits_ = 0;
    outline_ = outline;
  }

  /// From where the target is followed to; where it cannot be followed, from where it was, and it
  /// is lost if it is not there.
  std::optional<Seen> FollowAndMeasure(const cv::Mat& image) {
    constexpr double kArea = 1.2;
    const std::optional<Corners> followed = Follow(image);
    const auto seen = Measure(followed.value_or(outline_), options_.least_similarity, kArea);
    lost_ = !seen && (!followed || unseen_ >= kPatience);
    if (followed && !seen) outline_ = *followed;
    return seen;
  }

  /// Anywhere in the image. It has to be more like the target than what is where it should be.
  std::optional<Seen> SearchAndMeasure() {
    const std::optional<Corners> guess = Search();
    if (!guess) return std::nullopt;
    const auto seen = Measure(*guess, 0.5 * (1.0 + options_.least_similarity), kGuessedArea);
    lost_ = !seen;
    return seen;
  }

  /// From there, with the template that tells most of the size; with the first one alone if it fits
  /// well. Its area is at most `growth` times that of the guess, or as many times less.
  std::optional<Seen> Measure(const Corners& guess, double least, double growth) {
    std::optional<Seen> best;
    double most_similar = -1.0;
    for (std::size_t i = 0; i < templates_.size(); ++i) {
      const Template& one = templates_[i];
      const Corners from = CornersOf(one.patch);
      const auto found = Align(
          one.patch, grey_, cv::getPerspectiveTransform(from.data(), guess.data()), options_.warp);
      if (!found || found->similarity < least) continue;
      const Corners outline = Moved(found->warp, from);
      if (!IsSane(outline, guess, growth, grey_.size())) continue;
      most_similar = std::max(most_similar, found->similarity);
      const Seen seen = See(one, *found, outline);
      const auto relative = [](const Seen& of) {
        return of.variance / (of.inverse_scale * of.inverse_scale);
      };
      if (best && relative(seen) >= relative(*best)) continue;
      best = seen;
      last_ = i;
      outline_ = outline;
      if (i == 0 && found->similarity >= options_.refresh_similarity) break;
    }
    if (best) Refresh(*best, most_similar);
    return best;
  }

  Seen See(const Template& one, const Alignment& found, const Corners& outline) const {
    const auto number = [&](const cv::Matx33d& warp) { return InverseScale(one, warp); };
    const double scale = InverseScale(one, found.warp);
    const double relative = found.Variance(one.patch, number) / (scale * scale) + one.variance;
    const double all = one.scale * scale;
    const cv::Rect2d box =
        cv::boundingRect(std::vector<cv::Point2f>(outline.begin(), outline.end()));
    return {Apply(found.warp, Middle(one.patch)), box, all, all * all * relative};
  }

  /// Size of the target where the template was taken / size under `warp`. Of a plane under a
  /// homography the depth of its middle x under `warp` / then: H = s (R + t n' / d) takes x, of
  /// third element 1, to s Z / Z0 times its image, and s is the middle singular value of H
  /// [Ma2004].
  double InverseScale(const Template& one, const cv::Matx33d& warp) const {
    const cv::Point2d middle = Middle(one.patch);
    if (options_.warp != Warp::kHomography) {
      return std::sqrt(AreaAt(one.taken, middle) / AreaAt(warp, middle));
    }
    const cv::Matx33d in_rays = intrinsics_->inv() * warp * one.taken.inv() * *intrinsics_;
    cv::Mat values;
    cv::SVD::compute(cv::Mat(in_rays), values, cv::SVD::NO_UV);
    const cv::Point2d pixel = Apply(one.taken, middle);
    const cv::Vec3d ray = intrinsics_->inv() * cv::Vec3d(pixel.x, pixel.y, 1.0);
    return std::abs((in_rays * (ray * (1.0 / ray[2])))[2]) / values.at<double>(1);
  }

  /// Takes another template where none has fitted well for some images, or the target is far larger
  /// or smaller than in the one that is used.
  void Refresh(const Seen& seen, double most_similar) {
    constexpr int kMisfits = 3;
    const double scale = seen.inverse_scale / templates_[last_].scale;
    const bool other_size = scale > options_.refresh_scale || scale < 1.0 / options_.refresh_scale;
    misfits_ = most_similar < options_.refresh_similarity ? misfits_ + 1 : 0;
    if (!other_size && misfits_ < kMisfits) return;
    const cv::Rect2d whole(0.0, 0.0, grey_.cols, grey_.rows);
    if ((seen.box & whole).area() < seen.box.area()) return;  // part of it is not seen
    TakeTemplate(outline_, seen.inverse_scale,
                 seen.variance / (seen.inverse_scale * seen.inverse_scale));
  }

  /// Not turned inside out, about as large as guessed, its middle on the image.
  static bool IsSane(const Corners& outline, const Corners& guess, double growth, cv::Size size) {
    const double grown = AreaOf(outline) / AreaOf(guess);
    const std::vector<cv::Point2f> polygon(outline.begin(), outline.end());
    const cv::Point2f middle = 0.25F * (outline[0] + outline[1] + outline[2] + outline[3]);
    return grown > 1.0 / growth && grown < growth && cv::isContourConvex(polygon) &&
           cv::contourArea(polygon, true) > 0.0 &&
           cv::Rect2f({0.0F, 0.0F}, cv::Size2f(size)).contains(middle);
  }

  /// By a grid of its points from the image before, the better half of them by where they are
  /// followed back to [Kalal2010], and the similarity that most agree on; none where too few do.
  std::optional<Corners> Follow(const cv::Mat& image) const {
    constexpr int kGrid = 12, kFewest = 8, kWindow = 15, kLevels = 4;
    constexpr double kBack = 2.0, kAgree = 1.5;  // px
    const cv::Matx33d to_image = FromUnit(outline_);
    std::vector<cv::Point2f> from, to, back;
    for (int i = 0; i < kGrid * kGrid; ++i) {
      const int row = i / kGrid;
      const cv::Point2d at((i % kGrid + 0.5) / kGrid, (row + 0.5) / kGrid);
      from.emplace_back(Apply(to_image, at));
    }
    std::vector<unsigned char> found, found_back, inlier;
    std::vector<float> ignored;
    const cv::Size window(kWindow, kWindow);
    cv::calcOpticalFlowPyrLK(before_, image, from, to, found, ignored, window, kLevels);
    cv::calcOpticalFlowPyrLK(image, before_, to, back, found_back, ignored, window, kLevels);
    std::vector<std::pair<double, std::size_t>> by_error;
    for (std::size_t i = 0; i < from.size(); ++i) {
      const double error = cv::norm(back[i] - from[i]);
      if (found[i] != 0 && found_back[i] != 0 && error < kBack) by_error.emplace_back(error, i);
    }
    std::ranges::sort(by_error);
    by_error.resize((by_error.size() + 1) / 2);
    if (std::ssize(by_error) < kFewest) return std::nullopt;
    std::vector<cv::Point2f> good_from, good_to;
    for (const auto& [error, i] : by_error) {
      good_from.push_back(from[i]);
      good_to.push_back(to[i]);
    }
    const cv::Mat similarity =
        cv::estimateAffinePartial2D(good_from, good_to, inlier, cv::RANSAC, kAgree);
    if (similarity.empty() || 2 * cv::countNonZero(inlier) < std::ssize(by_error)) {
      return std::nullopt;
    }
    cv::Matx33d moved = cv::Matx33d::eye();
    for (int i = 0; i < 2; ++i) {
      for (int j = 0; j < 3; ++j) moved(i, j) = similarity.at<double>(i, j);
    }
    return Moved(moved, outline_);
  }

  /// Where in the whole image something is most like a template, about as large as the target was.
  std::optional<Corners> Search() const {
    constexpr double kSide = 40.0, kMost = 1.5;  // px of the template as it is compared; times
    std::optional<Corners> best;
    double most = options_.least_similarity;
    for (std::size_t index = 0; index < templates_.size(); ++index) {
      const cv::Mat& patch = templates_[index].patch;
      const double last = std::sqrt(AreaOf(outline_) / patch.size().area());
      for (double factor = 1.0 / kMost; factor < kMost * 1.01;
           factor *= std::sqrt(std::sqrt(kMost))) {
        const double size = last * factor;  // px of the image for one of the template
        const double shrink = std::min(1.0, kSide / (size * std::max(patch.cols, patch.rows)));
        const double least_px = std::min(patch.cols, patch.rows) * size * shrink;
        if (!(least_px >= 6.0) || std::min(grey_.cols, grey_.rows) * shrink < 6.0) continue;
        cv::Mat small, looked, scores;
        cv::resize(grey_, small, {}, shrink, shrink, cv::INTER_AREA);
        cv::resize(patch, looked, {}, size * shrink, size * shrink, cv::INTER_AREA);
        if (looked.cols > small.cols || looked.rows > small.rows) continue;
        cv::matchTemplate(small, looked, scores, cv::TM_CCOEFF_NORMED);
        double score = 0.0;
        cv::Point at;
        cv::minMaxLoc(scores, nullptr, &score, nullptr, &at);
        if (!(score > most) || score > 1.0 + 1e-3) continue;  // above 1: nothing but one grey
        most = score;
        const cv::Matx33d warp(size, 0.0, at.x / shrink, 0.0, size, at.y / shrink, 0.0, 0.0, 1.0);
        best = Moved(warp, CornersOf(patch));
      }
    }
    return best;
  }

  TargetOptions options_;
  std::optional<cv::Matx33d> intrinsics_;
  std::vector<Template> templates_;
  std::size_t last_ = 0;  ///< the template that fitted the last image
  int misfits_ = 0;       ///< images in which none fitted well
  int unseen_ = 0;        ///< images since it was measured
  bool lost_ = false;
  Corners outline_{};  ///< of the target
  cv::Mat grey_;       ///< the image at hand, as float
  cv::Mat before_;     ///< the last image
};

}  // namespace alidade
