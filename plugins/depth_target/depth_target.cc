// SPDX-License-Identifier: Apache-2.0
#include "depth_target.h"

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "alidade/base/random.h"
#include "plugins/common/surfaces.h"

namespace alidade {
namespace {

class DepthTarget : public Source {
 public:
  explicit DepthTarget(const SourceArguments& arguments)
      : disparity_noise_(arguments.seed, 0),
        scale_noise_(arguments.seed, 1),
        image_noise_(arguments.seed, 2),
        texture_(arguments.seed, 3) {
    Params& p = arguments.params;
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    depth_mean_m_ = p.Positive("depth_mean_m", "m", "mean depth of the target", 0.3);
    amplitude_m_ =
        p.NonNegative("amplitude_m", "m", "amplitude of the motion; below depth_mean_m", 0.1);
    frequency_hz_ = p.NonNegative("frequency_hz", "Hz", "frequency of the motion", 0.4);
    step_s_ = 1.0 / p.Number("rate_hz", "Hz", "samples per second", {1e-6, 1e6}, 1.0 / 0.033);
    const double duration_s =
        p.Number("duration_s", "s", "maximum time of the last sample", {0.0, 1e9}, 5.0);
    focal_px_ = p.Positive("focal_px", "px", "rectified focal length", 400.0);
    baseline_m_ = p.Positive("baseline_m", "m", "stereo baseline", 0.065);
    bf_px_m_ = focal_px_ * baseline_m_;
    sigma_disparity_px_ =
        p.NonNegative("sigma_disparity_px", "px", "disparity noise, 1 sigma", 1.0);
    missing_ = p.Number("missing", "1", "probability that the disparity is missing (poor texture)",
                        {0.0, 1.0}, 0.0);
    outlier_share_ =
        p.Number("outliers.share", "1",
                 "probability that a disparity is wrong: uniform from 0 to the largest one",
                 {0.0, 1.0}, 0.0);
    const double min_range_m =
        p.NonNegative("min_range_m", "m", "minimum depth that stereo measures; 0: no limit", 0.3);
    blind_by_true_depth_ =
        p.Choice("blind_test", {"measured", "true_depth"},
                 "disparity that is compared with the limit (min_range_m): noisy or exact", 0) == 1;
    const double template_px = p.Positive("template_px", "px", "width of the template", 300.0);
    const double sigma_edge_px =
        p.NonNegative("sigma_edge_px", "px", "noise of an edge of the target, 1 sigma", 1.0);
    template_depth_m_ =
        p.Positive("template_depth_m", "m", "depth at which the template was recorded", 0.3);
    width_px_ = p.Integer("image.width", "width of the images, px", 16, 1 << 14, 640);
    height_px_ = p.Integer("image.height", "height of the images, px", 16, 1 << 14, 480);
    image_noise_grey_ =
        p.NonNegative("image.noise_grey", "1", "noise of a pixel, in grey levels (0 to 255)", 2.0);
    wall_m_ =
        p.Positive("image.wall_m", "m", "depth of the wall behind the target", 5.0 * depth_mean_m_);
    if (!(wall_m_ > depth_mean_m_ + amplitude_m_)) {
      p.Fail("image.wall_m",
             "must exceed depth_mean_m + amplitude_m; otherwise the wall hides the target");
    }
    target_m_ = template_px * template_depth_m_ / focal_px_;
    if (!(amplitude_m_ < depth_mean_m_)) {
      p.Fail("amplitude_m",
             "must be less than depth_mean_m; otherwise the target reaches the camera");
    }
    disparity_limit_px_ = min_range_m > 0.0 ? bf_px_m_ / min_range_m : kInfinity;
    relative_sigma_ = 2.0 * sigma_edge_px / template_px;
    // Allows for rounding if the duration is a multiple of the step.
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
    constexpr double kWidest = 20.0;  // size / depth of the wall; fills the image
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
    const bool is_in_range =
        !((blind_by_true_depth_ ? exact_px : disparity_px) > disparity_limit_px_);
    // Simulates poor texture: no match, or a wrong match anywhere in the search range.
    const double nearest_px = bf_px_m_ / (depth_mean_m_ - amplitude_m_);
    const bool is_missing = texture_.Uniform() < missing_;
    const bool is_wrong = texture_.Uniform() < outlier_share_;
    const double anywhere_px = std::min(nearest_px, disparity_limit_px_) * texture_.Uniform();
    const double matched_px = is_wrong ? anywhere_px : disparity_px;
    const double exact_scale = template_depth_m_ / depth_m;
    const double scale = exact_scale + relative_sigma_ / exact_scale * scale_noise_.Normal();

    frame.measurements.clear();
    if (is_in_range && !is_missing) Emit(kDisparity, matched_px, frame);
    if (!is_missing) Emit(kDisparityAll, matched_px, frame);
    Emit(kInverseScale, 1.0 / scale, frame);
    Emit(is_in_range ? kInverseScaleSeeing : kInverseScaleBlind, 1.0 / scale, frame);
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
  double depth_m_ = 0.0;  ///< true depth in the last frame
  double disparity_limit_px_, relative_sigma_, template_depth_m_;
  bool blind_by_true_depth_;
  std::int64_t count_, index_ = 0;
  double missing_, outlier_share_;
  Random disparity_noise_, scale_noise_, image_noise_, texture_;
};

}  // namespace

std::unique_ptr<Source> CreateDepthTarget(const SourceArguments& arguments) {
  return std::make_unique<DepthTarget>(arguments);
}

}  // namespace alidade
