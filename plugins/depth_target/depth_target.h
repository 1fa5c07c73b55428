// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <vector>

#include "alidade/base/random.h"
#include "alidade/host/source.h"
#include "plugins/common/surfaces.h"

namespace alidade {

/// A target that swings along the optical axis, seen by a stereo pair and by the size of its image.
///
///   truth      Z(t) = Zm + A sin(2 pi f t),   Zdot = dZ/dt,   lambda = 1 / Z0
///   stereo     d = F B / Z + sigma_d n1,   n1 ~ N(0, 1);   seen unless d > F B / Zn
///   size       scale = Z0 / Z + (2 sigma_e / (w Z0 / Z)) n2,   n2 ~ N(0, 1);   emitted: 1 / scale
///
///   symbol   parameter           unit  frame  2017   meaning
///   Zm       depth_mean_m        m     cam    0.3    mean depth; > 0
///   A        amplitude_m         m     cam    0.1    amplitude; 0 <= A < Zm
///   f        frequency_hz        Hz    -      0.4    frequency of the swing
///   t        rate_hz             Hz    -      30.3   t = 0, 1 / rate_hz, 2 / rate_hz, ...
///            duration_s          s     -      5      ... <= duration_s
///   F        focal_px            px    -      400    rectified focal length
///   B        baseline_m          m     -      0.065  stereo baseline
///   sigma_d  sigma_disparity_px  px    left   1      disparity noise, 1 sigma
///   Zn       min_range_m         m     left   0.3    stereo sees nothing nearer; 0: no limit
///   w        template_px         px    cam    300    width of the template
///   Z0       template_depth_m    m     cam    0.3    depth at which the template was taken
///   sigma_e  sigma_edge_px      px    cam    1      noise of one edge of the target, 1 sigma
///            missing             1     -      0      probability that there is no disparity
///            outliers.share      1     -      0      probability that d is U(0, its largest)
///
///   stream                  size  unit  when
///   disparity               1     px    while stereo sees, but for those that are missing
///   disparity_all           1     px    while none is missing: for a sensor that judges validity
///   inverse_scale           1     -     always
///   inverse_scale_seeing    1     -     the same value, while stereo sees
///   inverse_scale_blind     1     -     the same value, while stereo is blind
///
/// n1 and n2 come from streams 0 and 1 of the seed, one of each per sample whatever is emitted.
///
/// Drawn, the target is a textured square of w Z0 / F metres that faces the pair, on the axis of
/// the left camera, before a textured wall. Images are image.width times image.height, their
/// principal points in the middle. Their noise comes from stream 2, what is missing or wrong from
/// stream 3.
///
/// What the notebook does differently, or says twice: it thresholds the NOISY disparity, so that
/// the disparities that pass are biased: -0.85 px where F B / Z is within 1 px of the limit, -0.33
/// px within 3 px (sigma_d 1 px, example 01). `blind_test: true_depth` thresholds F B / Z instead.
/// Its text says 25 cm and 1 Hz, its code 30 cm and 0.4 Hz, the defaults here. A blind disparity is
/// a sentinel of 1e9 px there; here it is missing. Its noise of the scale counts both edges
/// linearly, 2 sigma_e, as is done here.
///
/// Defined for  A < Zm; else the configuration is refused.
/// Source       [Ekf2017] sec. 2-4.
class DepthTarget : public Source {
 public:
  explicit DepthTarget(const SourceArguments& arguments)
      : DepthTarget(arguments.params, arguments.seed) {}
  DepthTarget(Params& p, std::uint64_t seed)
      : disparity_noise_(seed, 0), scale_noise_(seed, 1), image_noise_(seed, 2), texture_(seed, 3) {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    depth_mean_m_ = p.Positive("depth_mean_m", "m", "mean depth of the target", 0.3);
    amplitude_m_ = p.NonNegative("amplitude_m", "m", "amplitude; below depth_mean_m", 0.1);
    frequency_hz_ = p.NonNegative("frequency_hz", "Hz", "frequency of the swing", 0.4);
    step_s_ = 1.0 / p.Number("rate_hz", "Hz", "samples a second", {1e-6, 1e6}, 1.0 / 0.033);
    const double duration_s =
        p.Number("duration_s", "s", "time of the last sample, at most", {0.0, 1e9}, 5.0);
    focal_px_ = p.Positive("focal_px", "px", "rectified focal length", 400.0);
    baseline_m_ = p.Positive("baseline_m", "m", "stereo baseline", 0.065);
    bf_px_m_ = focal_px_ * baseline_m_;
    sigma_disparity_px_ =
        p.NonNegative("sigma_disparity_px", "px", "disparity noise, 1 sigma", 1.0);
    missing_ = p.Number("missing", "1", "probability that there is no disparity: poor texture",
                        {0.0, 1.0}, 0.0);
    outlier_share_ =
        p.Number("outliers.share", "1",
                 "probability that a disparity is anything from 0 to the largest: poor texture",
                 {0.0, 1.0}, 0.0);
    const double min_range_m =
        p.NonNegative("min_range_m", "m", "stereo is blind to what is nearer; 0: to nothing", 0.3);
    blind_by_true_depth_ =
        p.Choice("blind_test", {"measured", "true_depth"},
                 "disparity that min_range_m is compared with: noisy or exact", 0) == 1;
    const double template_px = p.Positive("template_px", "px", "width of the template", 300.0);
    const double sigma_edge_px =
        p.NonNegative("sigma_edge_px", "px", "noise of an edge of the target, 1 sigma", 1.0);
    template_depth_m_ =
        p.Positive("template_depth_m", "m", "depth at which the template was taken", 0.3);
    width_px_ = p.Integer("image.width", "of the images, px", 16, 1 << 14, 640);
    height_px_ = p.Integer("image.height", "of the images, px", 16, 1 << 14, 480);
    image_noise_grey_ =
        p.NonNegative("image.noise_grey", "1", "noise of a pixel's grey, of 255", 2.0);
    wall_m_ =
        p.Positive("image.wall_m", "m", "depth of the wall behind the target", 5.0 * depth_mean_m_);
    if (!(wall_m_ > depth_mean_m_ + amplitude_m_)) {
      p.Fail("image.wall_m", "must be more than depth_mean_m + amplitude_m: it hides the target");
    }
    target_m_ = template_px * template_depth_m_ / focal_px_;
    if (!(amplitude_m_ < depth_mean_m_)) {
      p.Fail("amplitude_m", "must be less than depth_mean_m: the target would reach the camera");
    }
    disparity_limit_px_ = min_range_m > 0.0 ? bf_px_m_ / min_range_m : kInfinity;
    relative_sigma_ = 2.0 * sigma_edge_px / template_px;
    // A few units in the last place, for durations that are multiples of the step but for rounding.
    count_ = 1 + static_cast<std::int64_t>(duration_s / step_s_ * (1.0 + 4.0 * DBL_EPSILON));
  }

  const std::vector<StreamInfo>& streams() const override { return streams_; }
  const std::vector<StreamInfo>& truths() const override { return truths_; }
  std::int64_t size() const override { return count_; }

  int views() const override { return 2; }
  GreyImage Draw(int view) override {
    const Camera camera(width_px_, height_px_, focal_px_, focal_px_, 0.5 * (width_px_ - 1),
                        0.5 * (height_px_ - 1));
    const auto square = [](double side_m, double depth, double grain_m, std::uint64_t texture) {
      const Eigen::Vector3d x(side_m, 0.0, 0.0), y(0.0, side_m, 0.0), middle(0.0, 0.0, depth);
      return Rectangle{middle - 0.5 * (x + y), x, y, grain_m, texture};
    };
    constexpr double kWidest = 20.0;  // of its depth: fills the image
    const std::vector<Rectangle> surfaces = {square(target_m_, depth_m_, 0.25 * target_m_, 0),
                                             square(kWidest * wall_m_, wall_m_, 0.5 * wall_m_, 1)};
    const double eye[3] = {view * baseline_m_, 0.0, 0.0}, level[4] = {1.0, 0.0, 0.0, 0.0};
    return Render(surfaces, camera, eye, level, image_noise_grey_, image_noise_);
  }

  bool Next(SourceFrame& frame) override {
    if (index_ == count_) return false;
    const double t_s = static_cast<double>(index_++) * step_s_;
    const double omega = 2.0 * std::numbers::pi * frequency_hz_;
    const double depth_m = depth_mean_m_ + amplitude_m_ * std::sin(omega * t_s);
    depth_m_ = depth_m;
    const double rate_m_s = amplitude_m_ * omega * std::cos(omega * t_s);
    frame.timestamp = TimestampFromSeconds(t_s);
    frame.truth = {{depth_m}, {rate_m_s}, {1.0 / template_depth_m_}};

    const double exact_px = bf_px_m_ / depth_m;
    const double disparity_px = exact_px + sigma_disparity_px_ * disparity_noise_.Normal();
    const bool sees = !((blind_by_true_depth_ ? exact_px : disparity_px) > disparity_limit_px_);
    // Of texture that is poor: no match, or a wrong one anywhere in the search.
    const double nearest_px = bf_px_m_ / (depth_mean_m_ - amplitude_m_);
    const bool missing = texture_.Uniform() < missing_;
    const bool wrong = texture_.Uniform() < outlier_share_;
    const double anywhere_px = std::min(nearest_px, disparity_limit_px_) * texture_.Uniform();
    const double matched_px = wrong ? anywhere_px : disparity_px;
    const double exact_scale = template_depth_m_ / depth_m;
    const double scale = exact_scale + relative_sigma_ / exact_scale * scale_noise_.Normal();

    frame.measurements.clear();
    if (sees && !missing) Emit(kDisparity, matched_px, frame);
    if (!missing) Emit(kDisparityAll, matched_px, frame);
    Emit(kInverseScale, 1.0 / scale, frame);
    Emit(sees ? kInverseScaleSeeing : kInverseScaleBlind, 1.0 / scale, frame);
    return true;
  }

 private:
  enum Stream { kDisparity, kDisparityAll, kInverseScale, kInverseScaleSeeing, kInverseScaleBlind };

  static void Emit(Stream stream, double value, Frame& frame) {
    Measurement measurement;
    measurement.timestamp = frame.timestamp;
    measurement.stream = stream;
    measurement.values = {value};
    frame.measurements.push_back(std::move(measurement));
  }

  const std::vector<StreamInfo> streams_{{"disparity", 1},
                                         {"disparity_all", 1},
                                         {"inverse_scale", 1},
                                         {"inverse_scale_seeing", 1},
                                         {"inverse_scale_blind", 1}};
  const std::vector<StreamInfo> truths_{{"depth", 1}, {"depth_rate", 1}, {"inverse_distance", 1}};
  double depth_mean_m_, amplitude_m_, frequency_hz_, step_s_, sigma_disparity_px_;
  double focal_px_, baseline_m_, bf_px_m_, wall_m_, target_m_, image_noise_grey_;
  int width_px_, height_px_;
  double depth_m_ = 0.0;  ///< of the last frame
  double disparity_limit_px_, relative_sigma_, template_depth_m_;
  bool blind_by_true_depth_;
  std::int64_t count_, index_ = 0;
  double missing_, outlier_share_;
  Random disparity_noise_, scale_noise_, image_noise_, texture_;
};

inline std::unique_ptr<Source> CreateDepthTarget(const SourceArguments& arguments) {
  return std::make_unique<DepthTarget>(arguments);
}

}  // namespace alidade
