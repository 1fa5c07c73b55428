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

/// Options of the tracking of a target.
struct TargetOptions {
  Warp warp;
  double min_similarity;      ///< of the target and its template, for a measurement
  double max_relative_sigma;  ///< relative sigma of the scale, for a measurement
  double refresh_similarity;  ///< a lower one requires a new template
  double refresh_scale;       ///< a larger change of scale requires a new template

  explicit TargetOptions(Params& p)
      : warp(static_cast<Warp>(p.Choice(
            "warp", {"similarity", "affine", "homography"},
            "possible changes of the target in the image: it moves, turns and grows; or also "
            "stretches and shears; or is a plane that tilts, which needs `camera` or "
            "`stereo`",
            0))),
        min_similarity(p.Number("min_similarity", "1",
                                "the target is lost if it correlates less with its template",
                                {-1.0, 1.0}, 0.7)),
        max_relative_sigma(p.Positive("max_relative_sigma", "1",
                                      "maximum of standard deviation of the scale / scale", 0.2)),
        refresh_similarity(p.Number("refresh_similarity", "1",
                                    "a new template is recorded if it correlates less; each new "
                                    "template adds its error to all later measurements",
                                    {-1.0, 1.0}, 0.8)),
        refresh_scale(p.Number("refresh_scale", "1",
                               "a new template is recorded if the target is larger or smaller by "
                               "more than this factor",
                               {1.0, 1e3, true, false}, 1.7)) {}
};

/// Tracker of one target in the images of a camera, which measures its size.
///
/// A grid of its points is tracked from the last image [Lucas1981], [Kalal2010], and a similarity
/// is fitted to them. From there the target is aligned with a template, see Align(), so that errors
/// do not accumulate from image to image. The first template is used as long as it fits well.
/// Otherwise the tracker chooses, among it and templates recorded later, the template with the most
/// precise size. Each template adds its own error.
///
/// If no template fits, the target is searched for nearby, see FindNearby(), and aligned with the
/// templates as the motion blurs them [Jin2005]. A blurred image determines the size less well,
/// which is included in its variance; it provides neither a template nor a size for the next image.
/// A target that is not found either is followed for some images. It is then lost, and the whole
/// image is searched.
class TargetTracker {
 public:
  using Corners = alidade::Corners;

  /// Position and size of the target.
  struct TrackedTarget {
    cv::Point2d middle;    ///< px, of the point that was the middle in the first image
    cv::Rect2d box;        ///< px, upright, around the whole target
    double inverse_scale;  ///< size in the first image / size; for a plane depth / first depth
    double variance;       ///< of inverse_scale
  };

  /// `intrinsics` is the camera matrix, which a homography needs.
  TargetTracker(const TargetOptions& options, const std::optional<cv::Matx33d>& intrinsics)
      : options_(options), intrinsics_(intrinsics) {}

  /// Measures the target in the next image. Returns nullopt if it cannot be measured. `corners` is
  /// its known outline. The first image with `corners`, and texture inside, starts the tracking.
  std::optional<TrackedTarget> Track(const cv::Mat& image, const std::optional<Corners>& corners) {
    std::optional<TrackedTarget> tracked;
    image.convertTo(grey_, CV_32F);
    if (corners) {
      const Corners inner = Inset(*corners);
      const bool first = templates_.empty();
      if (first) AddTemplate({grey_, inner, 1.0, 0.0}, inner);
      tracked = Accept(Measure(inner, options_.min_similarity, kBoxGrowth));
      is_lost_ = false;
      if (!tracked) outline_ = inner;
      if (first && !tracked) templates_.clear();  // a template without texture fits nothing
    } else if (!templates_.empty()) {
      if (!is_lost_) tracked = FollowAndMeasure(image);
      if (is_lost_) tracked = SearchAndMeasure();
    }
    unmeasured_ = tracked ? 0 : unmeasured_ + 1;
    image.copyTo(last_image_);
    return tracked;
  }

  /// Returns the outline in the last image, also if the target was followed but not measured, or
  /// nullopt if it is lost.
  std::optional<Corners> outline() const {
    if (is_lost_ || templates_.empty()) return std::nullopt;
    return outline_;
  }

 private:
  static constexpr std::size_t kTemplates = 6;  ///< maximum number
  static constexpr int kMaxUnmeasured = 10;     ///< images without a measurement
  static constexpr double kBoxGrowth = 2.0;     ///< maximum change of the area of a given box

  /// Target that was aligned with a template.
  struct Fit {
    TrackedTarget tracked;
    Corners outline;
    std::size_t index;      ///< of the template
    double max_similarity;  ///< of all templates
    bool is_blurred;

    double relative_variance() const {
      return tracked.variance / (tracked.inverse_scale * tracked.inverse_scale);
    }
  };

  /// Removes the rim, which mixes with the background of the target, and would bias the size.
  static Corners Inset(const Corners& corners) {
    constexpr float kRim = 0.04F;
    constexpr float kFarRim = 1.0F - kRim;
    return ApplyToCorners(
        FromUnit(corners),
        {cv::Point2f(kRim, kRim), {kFarRim, kRim}, {kFarRim, kFarRim}, {kRim, kFarRim}});
  }

  void AddTemplate(TargetTemplate new_template, const Corners& outline) {
    if (templates_.size() == kTemplates) templates_.erase(templates_.begin() + 1);
    templates_.push_back(std::move(new_template));
    last_ = templates_.size() - 1;
    misfits_ = 0;
    outline_ = outline;
  }

  /// Measures the target from its followed position or, if it cannot be followed, from the last
  /// one. The target is lost if it is neither there nor nearby.
  std::optional<TrackedTarget> FollowAndMeasure(const cv::Mat& image) {
    constexpr double kGrowth = 1.2, kNearbyGrowth = 1.5;
    const std::optional<Corners> followed = Follow(image);
    const Corners start = followed.value_or(outline_);
    auto fit = Measure(start, options_.min_similarity, kGrowth);
    if (!fit) {
      std::vector<const TargetTemplate*> candidates{&templates_[0]};
      if (last_ > 0) candidates.push_back(&templates_[last_]);
      if (const auto match = FindNearby(candidates, grey_, start, outline_)) {
        fit = Measure(match->outline, options_.min_similarity, kNearbyGrowth, match->blur);
      }
    }
    is_lost_ = !fit && (!followed || unmeasured_ >= kMaxUnmeasured);
    if (followed && !fit) outline_ = *followed;
    return Accept(fit);
  }

  /// Searches the whole image. A match must correlate more than at the expected position.
  std::optional<TrackedTarget> SearchAndMeasure() {
    const auto guess = FindAnywhere(templates_, grey_, outline_, options_.min_similarity);
    if (!guess) return std::nullopt;
    const auto fit = Measure(*guess, 0.5 * (1.0 + options_.min_similarity), kBoxGrowth);
    is_lost_ = !fit;
    return Accept(fit);
  }

  /// Measures the target from `guess`, with the template that has the most precise size, or with
  /// the first template if it fits well. The area changes at most by the factor `growth`.
  std::optional<Fit> Measure(const Corners& guess, double min_similarity, double growth,
                             const MotionBlur& blur = {}) const {
    std::optional<Fit> best;
    double max_similarity = -1.0;
    for (std::size_t i = 0; i < templates_.size(); ++i) {
      const TargetTemplate& target_template = templates_[i];
      const auto found = AlignBlurred(target_template, target_template.WarpTo(guess), blur);
      if (!found || found->similarity < min_similarity) continue;
      const Corners outline = ApplyToCorners(found->warp, target_template.corners());
      if (!IsSane(outline, guess, growth, grey_.size())) continue;
      max_similarity = std::max(max_similarity, found->similarity);
      const Fit fit{ToTrackedTarget(target_template, *found, outline), outline, i, 0.0,
                    blur.length > 0.0};
      const double sigma = std::sqrt(fit.relative_variance());
      if (!(sigma <= options_.max_relative_sigma)) continue;
      if (best && fit.relative_variance() >= best->relative_variance()) continue;
      best = fit;
      if (i == 0 && found->similarity >= options_.refresh_similarity) break;
    }
    if (best) best->max_similarity = max_similarity;
    return best;
  }

  /// Aligns with this blur or one of about its length, whichever is most similar.
  std::optional<Alignment> AlignBlurred(const TargetTemplate& target_template,
                                        const cv::Matx33d& start, const MotionBlur& blur) const {
    std::optional<Alignment> best;
    for (const MotionBlur& candidate : blur.Neighbours()) {
      const auto found = Align(target_template.Blurred(candidate), grey_, best ? best->warp : start,
                               options_.warp);
      if (found && (!best || found->similarity > best->similarity)) best = found;
    }
    return best;
  }

  /// Continues the tracking from a fit. Only the position of a blurred target is used.
  std::optional<TrackedTarget> Accept(const std::optional<Fit>& fit) {
    if (!fit) return std::nullopt;
    if (fit->is_blurred) {
      const cv::Point2f shift = MiddleOf(fit->outline) - MiddleOf(outline_);
      for (cv::Point2f& corner : outline_) corner += shift;
    } else {
      last_ = fit->index;
      outline_ = fit->outline;
      Refresh(*fit);
    }
    return fit->tracked;
  }

  TrackedTarget ToTrackedTarget(const TargetTemplate& target_template, const Alignment& found,
                                const Corners& outline) const {
    const auto inverse_scale = [&](const cv::Matx33d& warp) {
      return InverseScale(target_template, warp);
    };
    const double scale = InverseScale(target_template, found.warp);
    const double relative =
        found.Variance(target_template.patch(), inverse_scale) / (scale * scale) +
        target_template.variance();
    const double total_scale = target_template.scale() * scale;
    const cv::Rect2d box =
        cv::boundingRect(std::vector<cv::Point2f>(outline.begin(), outline.end()));
    return {Apply(found.warp, Middle(target_template.patch())), box, total_scale,
            total_scale * total_scale * relative};
  }

  /// Returns the size of the target when the template was recorded / its size under `warp`. For a
  /// plane under a homography it is the depth Z of its middle x under `warp` / its depth Z0 then:
  ///
  ///   H = s (R + t n' / d) maps x, with third element 1, to s Z / Z0 times its image
  ///
  /// with the middle singular value s of H [Ma2004].
  double InverseScale(const TargetTemplate& target_template, const cv::Matx33d& warp) const {
    const cv::Point2d middle = Middle(target_template.patch());
    if (options_.warp != Warp::kHomography) {
      return std::sqrt(AreaScaleAt(target_template.image_from_patch(), middle) /
                       AreaScaleAt(warp, middle));
    }
    const cv::Matx33d in_rays =
        intrinsics_->inv() * warp * target_template.image_from_patch().inv() * *intrinsics_;
    cv::Mat values;
    cv::SVD::compute(cv::Mat(in_rays), values, cv::SVD::NO_UV);
    const cv::Point2d pixel = Apply(target_template.image_from_patch(), middle);
    const cv::Vec3d ray = intrinsics_->inv() * cv::Vec3d(pixel.x, pixel.y, 1.0);
    return std::abs((in_rays * (ray * (1.0 / ray[2])))[2]) / values.at<double>(1);
  }

  /// Records a new template if no template has fitted well for some images, or if the target is
  /// much larger or smaller than in the current template. A blurred template is not used.
  void Refresh(const Fit& fit) {
    constexpr int kMisfits = 3;
    constexpr double kSharp = 0.4;
    const TargetTemplate& current = templates_[last_];
    const double scale = fit.tracked.inverse_scale / current.scale();
    const bool other_size = scale > options_.refresh_scale || scale < 1.0 / options_.refresh_scale;
    misfits_ = fit.max_similarity < options_.refresh_similarity ? misfits_ + 1 : 0;
    if (!other_size && misfits_ < kMisfits) return;
    const cv::Rect2d image_area(0.0, 0.0, grey_.cols, grey_.rows);
    if ((fit.tracked.box & image_area).area() < fit.tracked.box.area())
      return;  // a part is not visible
    TargetTemplate new_template(grey_, fit.outline, fit.tracked.inverse_scale,
                                fit.relative_variance());
    if (new_template.Sharpness() < kSharp * current.Sharpness()) return;
    AddTemplate(std::move(new_template), fit.outline);
  }

  /// Returns true if the outline is not inverted, about as large as guessed, and its middle is in
  /// the image.
  static bool IsSane(const Corners& outline, const Corners& guess, double growth, cv::Size size) {
    const double area_ratio = AreaOf(outline) / AreaOf(guess);
    const std::vector<cv::Point2f> polygon(outline.begin(), outline.end());
    const cv::Point2f middle = 0.25F * (outline[0] + outline[1] + outline[2] + outline[3]);
    return area_ratio > 1.0 / growth && area_ratio < growth && cv::isContourConvex(polygon) &&
           cv::contourArea(polygon, true) > 0.0 &&
           cv::Rect2f({0.0F, 0.0F}, cv::Size2f(size)).contains(middle);
  }

  /// Follows a grid of points from the last image. It uses the better half of them, by the error
  /// when they are followed back [Kalal2010], and the similarity with the most inliers. Returns
  /// nullopt if too few agree.
  std::optional<Corners> Follow(const cv::Mat& image) const {
    constexpr int kGrid = 12, kMinPoints = 8, kWindow = 15, kLevels = 4;
    constexpr double kMaxReturnError = 2.0, kMaxResidual = 1.5;  // px
    const cv::Matx33d to_image = FromUnit(outline_);
    std::vector<cv::Point2f> start, end, returned;
    for (int i = 0; i < kGrid * kGrid; ++i) {
      const int row = i / kGrid;
      const cv::Point2d unit_point((i % kGrid + 0.5) / kGrid, (row + 0.5) / kGrid);
      start.emplace_back(Apply(to_image, unit_point));
    }
    std::vector<unsigned char> found, found_returned, inlier;
    std::vector<float> ignored;
    const cv::Size window(kWindow, kWindow);
    cv::calcOpticalFlowPyrLK(last_image_, image, start, end, found, ignored, window, kLevels);
    cv::calcOpticalFlowPyrLK(image, last_image_, end, returned, found_returned, ignored, window,
                             kLevels);
    std::vector<std::pair<double, std::size_t>> by_error;
    for (std::size_t i = 0; i < start.size(); ++i) {
      const double error = cv::norm(returned[i] - start[i]);
      if (found[i] != 0 && found_returned[i] != 0 && error < kMaxReturnError)
        by_error.emplace_back(error, i);
    }
    std::ranges::sort(by_error);
    by_error.resize((by_error.size() + 1) / 2);
    if (std::ssize(by_error) < kMinPoints) return std::nullopt;
    std::vector<cv::Point2f> good_start, good_end;
    for (const auto& [error, i] : by_error) {
      good_start.push_back(start[i]);
      good_end.push_back(end[i]);
    }
    const cv::Mat similarity =
        cv::estimateAffinePartial2D(good_start, good_end, inlier, cv::RANSAC, kMaxResidual);
    if (similarity.empty() || 2 * cv::countNonZero(inlier) < std::ssize(by_error)) {
      return std::nullopt;
    }
    cv::Matx33d motion = cv::Matx33d::eye();
    for (int i = 0; i < 2; ++i) {
      for (int j = 0; j < 3; ++j) motion(i, j) = similarity.at<double>(i, j);
    }
    return ApplyToCorners(motion, outline_);
  }

  TargetOptions options_;
  std::optional<cv::Matx33d> intrinsics_;
  std::vector<TargetTemplate> templates_;
  std::size_t last_ = 0;  ///< template that fitted the last image
  int misfits_ = 0;       ///< images in which no template fitted well
  int unmeasured_ = 0;    ///< images since the last measurement
  bool is_lost_ = false;
  Corners outline_{};   ///< of the target
  cv::Mat grey_;        ///< current image, as float
  cv::Mat last_image_;  ///< the last image
};

}  // namespace alidade
