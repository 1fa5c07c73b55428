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
  double min_similarity;      ///< minimum correlation of target and template
  double max_relative_sigma;  ///< maximum relative sigma of the scale
  double refresh_similarity;  ///< a lower correlation requires a new template
  double refresh_scale;       ///< a larger change of scale requires a new template

  explicit TargetOptions(Params& p)
      : warp(static_cast<Warp>(p.Choice(
            "warp", {"similarity", "affine", "homography"},
            "possible changes of the target in the image: similarity: shift, rotation and size; "
            "affine: stretch and shear, too; homography: a plane that tilts, which needs "
            "`camera` or `stereo`",
            0))),
        min_similarity(p.Number("min_similarity", "1",
                                "minimum correlation of the target with its template", {-1.0, 1.0},
                                0.7)),
        max_relative_sigma(p.Positive("max_relative_sigma", "1",
                                      "maximum relative standard deviation of the scale", 0.2)),
        refresh_similarity(p.Number("refresh_similarity", "1",
                                    "correlation below which a new template is recorded; each "
                                    "new template adds its error to all later measurements",
                                    {-1.0, 1.0}, 0.8)),
        refresh_scale(p.Number("refresh_scale", "1",
                               "a new template is recorded if the target is larger or smaller by "
                               "more than this factor",
                               {1.0, 1e3, true, false}, 1.7)) {}
};

/// Tracker that measures the size of one target in the images of a camera.
///
/// A grid of points of the target is tracked from the last image [Lucas1981], [Kalal2010], and a
/// similarity is fitted to these points. Starting from the similarity, the target is aligned with a
/// template, see Align(). Errors therefore do not accumulate from image to image. The first
/// template is used as long as it fits well. Otherwise the tracker uses the recorded template that
/// determines the size most precisely. Each template adds its own error.
///
/// If no template fits, the target is searched for nearby, see FindNearby(). It is then aligned
/// with templates to which the blur of the motion was applied [Jin2005]. A blurred image determines
/// the size less precisely, which increases the variance of the size. A blurred image provides
/// neither a template nor a size for the next image. If this search fails, too, the tracker follows
/// the target for some images without a measurement. After these images the target is lost, and the
/// tracker searches the whole image.
class TargetTracker {
 public:
  using Corners = alidade::Corners;

  /// Position and size of the target.
  struct TrackedTarget {
    cv::Point2d middle;    ///< point that was the middle in the first image, px
    cv::Rect2d box;        ///< upright box around the target, px
    double inverse_scale;  ///< first size / size; for a plane, depth / first depth
    double variance;       ///< variance of inverse_scale
  };

  /// `intrinsics` is the camera matrix, which a homography needs.
  TargetTracker(const TargetOptions& options, const std::optional<cv::Matx33d>& intrinsics)
      : options_(options), intrinsics_(intrinsics) {}

  /// Measures the target in the next image. Returns nullopt if the target cannot be measured.
  /// `corners` is the outline of the target, if it is known. Tracking starts with the first image
  /// with known `corners` and texture inside them.
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

  /// Returns the outline in the last image, even if the target was followed but not measured.
  /// Returns nullopt if the target is lost.
  std::optional<Corners> outline() const {
    if (is_lost_ || templates_.empty()) return std::nullopt;
    return outline_;
  }

 private:
  static constexpr std::size_t kTemplates = 6;  ///< maximum number of templates
  static constexpr int kMaxUnmeasured = 10;     ///< unmeasured images until the target is lost
  static constexpr double kBoxGrowth = 2.0;     ///< maximum ratio of the area to that of a box

  /// Target that was aligned with a template.
  struct Fit {
    TrackedTarget tracked;
    Corners outline;
    std::size_t index;      ///< index of the template
    double max_similarity;  ///< largest similarity of all templates
    bool is_blurred;

    double relative_variance() const {
      return tracked.variance / (tracked.inverse_scale * tracked.inverse_scale);
    }
  };

  /// Removes the rim of the target. The rim mixes with the background, which would bias the size.
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

  /// Measures the target, starting from the position to which it was followed. If it cannot be
  /// followed, starts from the last position. The target is lost if it is neither found nor
  /// followed, or after kMaxUnmeasured images without a measurement.
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

  /// Searches the whole image. A match must have a higher similarity than a match at an expected
  /// position.
  std::optional<TrackedTarget> SearchAndMeasure() {
    const auto guess = FindAnywhere(templates_, grey_, outline_, options_.min_similarity);
    if (!guess) return std::nullopt;
    const auto fit = Measure(*guess, 0.5 * (1.0 + options_.min_similarity), kBoxGrowth);
    is_lost_ = !fit;
    return Accept(fit);
  }

  /// Measures the target, starting from `guess`. Uses the first template if it fits well, else the
  /// template with the most precise size. The area may change by at most the factor `growth`.
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

  /// Aligns the template with this blur and with blurs of similar lengths. Returns the alignment
  /// with the highest similarity.
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

  /// Continues the tracking from a fit. If the target is blurred, only the position of the fit is
  /// used.
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

  /// Returns the size of the target in the image of the template, divided by its size under `warp`.
  /// For a plane under a homography, returns Z / Z0. Z0 is the depth of the middle x in the image
  /// of the template. Z is the depth under `warp`:
  ///
  ///   H = s (R + t n' / d) maps x, with third element 1, to s Z / Z0 times its image
  ///
  /// s is the middle singular value of H [Ma2004].
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
  /// much larger or smaller than in the current template. Does not record a blurred target.
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
      return;  // a part of the target is outside the image
    TargetTemplate new_template(grey_, fit.outline, fit.tracked.inverse_scale,
                                fit.relative_variance());
    if (new_template.Sharpness() < kSharp * current.Sharpness()) return;
    AddTemplate(std::move(new_template), fit.outline);
  }

  /// Returns true if the outline is plausible: not inverted, about as large as `guess`, and with
  /// its middle in the image.
  static bool IsSane(const Corners& outline, const Corners& guess, double growth, cv::Size size) {
    const double area_ratio = AreaOf(outline) / AreaOf(guess);
    const std::vector<cv::Point2f> polygon(outline.begin(), outline.end());
    const cv::Point2f middle = 0.25F * (outline[0] + outline[1] + outline[2] + outline[3]);
    return area_ratio > 1.0 / growth && area_ratio < growth && cv::isContourConvex(polygon) &&
           cv::contourArea(polygon, true) > 0.0 &&
           cv::Rect2f({0.0F, 0.0F}, cv::Size2f(size)).contains(middle);
  }

  /// Follows a grid of points from the last image to this image and back. Uses the half of the
  /// points that return closest to their starts [Kalal2010]. Fits the similarity with the most
  /// inliers. Returns nullopt if too few points agree with the similarity.
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
  std::size_t last_ = 0;  ///< index of the template that fitted last
  int misfits_ = 0;       ///< number of successive images without a good template
  int unmeasured_ = 0;    ///< number of images since the last measurement
  bool is_lost_ = false;
  Corners outline_{};   ///< outline of the target in the last image
  cv::Mat grey_;        ///< current image, as float
  cv::Mat last_image_;  ///< the last image
};

}  // namespace alidade
