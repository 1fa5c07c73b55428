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
#include "motion_blur.h"
#include "target_search.h"
#include "target_template.h"

namespace alidade {

/// How a target is followed.
struct TargetOptions {
  Warp warp;
  double min_similarity;      ///< of the target and its template, for a measurement
  double max_relative_sigma;  ///< of the scale, relative, likewise
  double refresh_similarity;  ///< below it the template is taken anew
  double refresh_scale;       ///< likewise where the target is so many times larger or smaller

  explicit TargetOptions(Params& p)
      : warp(static_cast<Warp>(p.Choice(
            "warp", {"similarity", "affine", "homography"},
            "how the target may change in the image: it moves, turns and grows; or is also "
            "stretched and sheared; or is plane and tilts, which needs `camera` or "
            "`stereo`",
            0))),
        min_similarity(p.Number("min_similarity", "1",
                                "the target is lost where it correlates less with its template",
                                {-1.0, 1.0}, 0.7)),
        max_relative_sigma(p.Positive("max_relative_sigma", "1",
                                      "standard deviation of the scale / scale, at most", 0.2)),
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
/// of its own.
///
/// Where none fits, the target is looked for about there, see FindNear(), and aligned with the
/// templates as the motion blurs them [Jin2005]. A blurred image tells the size less well, which
/// its variance says; it gives no template, and no size to follow on from. What is not found either
/// is followed on for some images; then it is lost, and looked for in the whole image.
class TargetTracker {
 public:
  using Corners = alidade::Corners;

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
      if (first) TakeTemplate({grey_, inner, 1.0, 0.0}, inner);
      seen = Keep(Measure(inner, options_.min_similarity, kGuessedArea));
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

  /// The target where a template was aligned.
  struct Fit {
    Seen seen;
    Corners outline;
    std::size_t index;    ///< of the template
    double most_similar;  ///< of those of all templates
    bool blurred;

    double relative_variance() const {
      return seen.variance / (seen.inverse_scale * seen.inverse_scale);
    }
  };

  /// Leaves out the rim, which mixes with what is behind the target, and would pull the size.
  static Corners Inset(const Corners& corners) {
    constexpr float kShare = 0.04F;
    constexpr float kRest = 1.0F - kShare;
    return Moved(FromUnit(corners),
                 {cv::Point2f(kShare, kShare), {kRest, kShare}, {kRest, kRest}, {kShare, kRest}});
  }

  void TakeTemplate(TargetTemplate taken, const Corners& outline) {
    if (templates_.size() == kTemplates) templates_.erase(templates_.begin() + 1);
    templates_.push_back(std::move(taken));
    last_ = templates_.size() - 1;
    misfits_ = 0;
    outline_ = outline;
  }

  /// From where the target is followed to; where it cannot be followed, from where it was. It is
  /// lost if it is not there, nor near.
  std::optional<Seen> FollowAndMeasure(const cv::Mat& image) {
    constexpr double kArea = 1.2, kNearArea = 1.5;
    const std::optional<Corners> followed = Follow(image);
    const Corners start = followed.value_or(outline_);
    auto fit = Measure(start, options_.min_similarity, kArea);
    if (!fit) {
      std::vector<const TargetTemplate*> likely{&templates_[0]};
      if (last_ > 0) likely.push_back(&templates_[last_]);
      if (const auto near = FindNear(likely, grey_, start, outline_)) {
        fit = Measure(near->outline, options_.min_similarity, kNearArea, near->blur);
      }
    }
    lost_ = !fit && (!followed || unseen_ >= kPatience);
    if (followed && !fit) outline_ = *followed;
    return Keep(fit);
  }

  /// Anywhere in the image. It has to be more like the target than what is where it should be.
  std::optional<Seen> SearchAndMeasure() {
    const auto guess = FindAnywhere(templates_, grey_, outline_, options_.min_similarity);
    if (!guess) return std::nullopt;
    const auto fit = Measure(*guess, 0.5 * (1.0 + options_.min_similarity), kGuessedArea);
    lost_ = !fit;
    return Keep(fit);
  }

  /// From there, with the template that tells most of the size; with the first one alone if it fits
  /// well. Its area is at most `growth` times that of the guess, or as many times less.
  std::optional<Fit> Measure(const Corners& guess, double least, double growth,
                             const MotionBlur& blur = {}) const {
    std::optional<Fit> best;
    double most_similar = -1.0;
    for (std::size_t i = 0; i < templates_.size(); ++i) {
      const TargetTemplate& one = templates_[i];
      const auto found = AlignBlurred(one, one.To(guess), blur);
      if (!found || found->similarity < least) continue;
      const Corners outline = Moved(found->warp, one.corners());
      if (!IsSane(outline, guess, growth, grey_.size())) continue;
      most_similar = std::max(most_similar, found->similarity);
      const Fit fit{See(one, *found, outline), outline, i, 0.0, blur.length > 0.0};
      const double sigma = std::sqrt(fit.relative_variance());
      if (!(sigma <= options_.max_relative_sigma)) continue;
      if (best && fit.relative_variance() >= best->relative_variance()) continue;
      best = fit;
      if (i == 0 && found->similarity >= options_.refresh_similarity) break;
    }
    if (best) best->most_similar = most_similar;
    return best;
  }

  /// With that blur or one about as long, whichever is most alike.
  std::optional<Alignment> AlignBlurred(const TargetTemplate& one, const cv::Matx33d& start,
                                        const MotionBlur& blur) const {
    std::optional<Alignment> best;
    for (const MotionBlur& like : blur.Neighbours()) {
      const auto found = Align(one.Blurred(like), grey_, best ? best->warp : start, options_.warp);
      if (found && (!best || found->similarity > best->similarity)) best = found;
    }
    return best;
  }

  /// The target is followed on from there. Of a blurred one only the place is kept.
  std::optional<Seen> Keep(const std::optional<Fit>& fit) {
    if (!fit) return std::nullopt;
    if (fit->blurred) {
      const cv::Point2f moved = MiddleOf(fit->outline) - MiddleOf(outline_);
      for (cv::Point2f& corner : outline_) corner += moved;
    } else {
      last_ = fit->index;
      outline_ = fit->outline;
      Refresh(*fit);
    }
    return fit->seen;
  }

  Seen See(const TargetTemplate& one, const Alignment& found, const Corners& outline) const {
    const auto number = [&](const cv::Matx33d& warp) { return InverseScale(one, warp); };
    const double scale = InverseScale(one, found.warp);
    const double relative = found.Variance(one.patch(), number) / (scale * scale) + one.variance();
    const double all = one.scale() * scale;
    const cv::Rect2d box =
        cv::boundingRect(std::vector<cv::Point2f>(outline.begin(), outline.end()));
    return {Apply(found.warp, Middle(one.patch())), box, all, all * all * relative};
  }

  /// Size of the target where the template was taken / size under `warp`. Of a plane under a
  /// homography the depth of its middle x under `warp` / then: H = s (R + t n' / d) takes x, of
  /// third element 1, to s Z / Z0 times its image, and s is the middle singular value of H
  /// [Ma2004].
  double InverseScale(const TargetTemplate& one, const cv::Matx33d& warp) const {
    const cv::Point2d middle = Middle(one.patch());
    if (options_.warp != Warp::kHomography) {
      return std::sqrt(AreaAt(one.taken(), middle) / AreaAt(warp, middle));
    }
    const cv::Matx33d in_rays = intrinsics_->inv() * warp * one.taken().inv() * *intrinsics_;
    cv::Mat values;
    cv::SVD::compute(cv::Mat(in_rays), values, cv::SVD::NO_UV);
    const cv::Point2d pixel = Apply(one.taken(), middle);
    const cv::Vec3d ray = intrinsics_->inv() * cv::Vec3d(pixel.x, pixel.y, 1.0);
    return std::abs((in_rays * (ray * (1.0 / ray[2])))[2]) / values.at<double>(1);
  }

  /// Takes another template where none has fitted well for some images, or the target is far larger
  /// or smaller than in the one that is used; none that is blurred.
  void Refresh(const Fit& fit) {
    constexpr int kMisfits = 3;
    constexpr double kSharp = 0.4;
    const TargetTemplate& used = templates_[last_];
    const double scale = fit.seen.inverse_scale / used.scale();
    const bool other_size = scale > options_.refresh_scale || scale < 1.0 / options_.refresh_scale;
    misfits_ = fit.most_similar < options_.refresh_similarity ? misfits_ + 1 : 0;
    if (!other_size && misfits_ < kMisfits) return;
    const cv::Rect2d whole(0.0, 0.0, grey_.cols, grey_.rows);
    if ((fit.seen.box & whole).area() < fit.seen.box.area()) return;  // part of it is not seen
    TargetTemplate taken(grey_, fit.outline, fit.seen.inverse_scale, fit.relative_variance());
    if (taken.Sharpness() < kSharp * used.Sharpness()) return;
    TakeTemplate(std::move(taken), fit.outline);
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

  TargetOptions options_;
  std::optional<cv::Matx33d> intrinsics_;
  std::vector<TargetTemplate> templates_;
  std::size_t last_ = 0;  ///< the template that fitted the last image
  int misfits_ = 0;       ///< images in which none fitted well
  int unseen_ = 0;        ///< images since it was measured
  bool lost_ = false;
  Corners outline_{};  ///< of the target
  cv::Mat grey_;       ///< the image at hand, as float
  cv::Mat before_;     ///< the last image
};

}  // namespace alidade
