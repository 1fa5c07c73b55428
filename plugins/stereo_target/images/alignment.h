// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <vector>

namespace alidade {

/// Family of changes of a patch from image to image. Each family includes the families before it.
enum class Warp { kSimilarity, kAffine, kHomography };

/// Returns the number of parameters of a small change of a warp.
inline int ParameterCount(Warp kind) { return 4 + 2 * static_cast<int>(kind); }

/// Returns the point of the image, px, to which the warp maps a point of the patch, px.
inline cv::Point2d Apply(const cv::Matx33d& warp, cv::Point2d point) {
  const cv::Vec3d image_point = warp * cv::Vec3d(point.x, point.y, 1.0);
  return {image_point[0] / image_point[2], image_point[1] / image_point[2]};
}

inline cv::Point2d Middle(const cv::Mat& patch) {
  return {0.5 * (patch.cols - 1), 0.5 * (patch.rows - 1)};
}
/// Returns half the longer side of a patch, px. Small changes have this unit of length.
inline double HalfSide(const cv::Mat& patch) { return 0.5 * std::max(patch.cols, patch.rows); }

/// Returns warp U (I + sum_i d_i E_i) U^-1: the warp after small changes d of the patch. The
/// changes are expressed in coordinates that are 0 in the middle of the patch and 1 at its edge. U
/// converts these coordinates to pixels. E_0 to E_7 are size, turn, shift right, shift down,
/// stretch, shear, and the two projective changes.
inline cv::Matx33d ApplyChange(const cv::Matx33d& warp, const cv::Mat& patch,
                               const Eigen::Ref<const Eigen::VectorXd>& d) {
  std::array<double, 8> values{};
  std::ranges::copy(d, values.begin());
  const auto& [size, turn, right, down, stretch, shear, tilt_x, tilt_y] = values;
  const cv::Matx33d change(1.0 + size + stretch, -turn + shear, right, turn + shear,
                           1.0 + size - stretch, down, tilt_x, tilt_y, 1.0);
  const cv::Point2d middle = Middle(patch);
  const double half = HalfSide(patch);
  const cv::Matx33d to_pixels(half, 0.0, middle.x, 0.0, half, middle.y, 0.0, 0.0, 1.0);
  cv::Matx33d changed = warp * to_pixels * change * to_pixels.inv();
  return changed * (1.0 / changed(2, 2));
}

/// Returns the warp of the given kind that agrees best with `warp` at the middle of the patch.
inline cv::Matx33d ReduceTo(const cv::Matx33d& warp, const cv::Mat& patch, Warp kind) {
  if (kind == Warp::kHomography) return warp;
  const cv::Point2d middle = Middle(patch), image_middle = Apply(warp, middle);
  const cv::Point2d x_step =
      Apply(warp, middle + cv::Point2d(0.5, 0.0)) - Apply(warp, middle - cv::Point2d(0.5, 0.0));
  const cv::Point2d y_step =
      Apply(warp, middle + cv::Point2d(0.0, 0.5)) - Apply(warp, middle - cv::Point2d(0.0, 0.5));
  cv::Matx22d a(x_step.x, y_step.x, x_step.y, y_step.y);
  if (kind == Warp::kSimilarity) {
    const double size = 0.5 * (a(0, 0) + a(1, 1)), turn = 0.5 * (a(1, 0) - a(0, 1));
    a = cv::Matx22d(size, -turn, turn, size);
  }
  return {a(0, 0), a(0, 1), image_middle.x - a(0, 0) * middle.x - a(0, 1) * middle.y,
          a(1, 0), a(1, 1), image_middle.y - a(1, 0) * middle.x - a(1, 1) * middle.y,
          0.0,     0.0,     1.0};
}

/// Returns d (area in the image) / d (area of the patch) at a point of the patch.
inline double AreaScaleAt(const cv::Matx33d& warp, cv::Point2d point) {
  const double w = warp(2, 0) * point.x + warp(2, 1) * point.y + warp(2, 2);
  return std::abs(cv::determinant(warp) / (w * w * w));
}

/// Patch that was found in an image.
struct Alignment {
  cv::Matx33d warp;            ///< warp from the patch to the image, px
  double similarity;           ///< correlation of patch and image, in [-1, 1]
  Eigen::MatrixXd covariance;  ///< covariance of d, see ApplyChange()

  /// Returns the variance of a function of the warp: g C g'. The gradient g is computed by central
  /// differences.
  double Variance(const cv::Mat& patch,
                  const std::function<double(const cv::Matx33d&)>& function) const {
    constexpr double kStep = 1e-5;
    Eigen::VectorXd gradient(covariance.rows());
    for (int i = 0; i < gradient.size(); ++i) {
      const Eigen::VectorXd step = kStep * Eigen::VectorXd::Unit(gradient.size(), i);
      gradient[i] =
          (function(ApplyChange(warp, patch, step)) - function(ApplyChange(warp, patch, -step))) /
          (2.0 * kStep);
    }
    return gradient.dot(covariance * gradient);
  }
};

/// Alignment of one patch in one image [Baker2004]. Both have grey values of type float:
///
///   patch(x) = a (sampled(x; warp) + J d) + b + e,   J = d sampled / d d
///
/// Weighted least squares determine the change d of the warp and the light (a, b). This step is
/// repeated until d is small. (If a and b were applied to the patch, a = 0 would fit any uniform
/// area.) Huber's loss reduces the weight of pixels with a large e, such as those of objects in
/// front of the target.
class PatchAlignment {
 public:
  PatchAlignment(const cv::Mat& patch, const cv::Mat& image, Warp kind)
      : patch_(patch), image_(image), count_(ParameterCount(kind)) {}

  /// Aligns the patch, starting from `warp`. Stores the result in `warp`. Returns false if the
  /// alignment does not converge, if less than half of the patch is in the image, or if the patch
  /// has no texture.
  bool Run(cv::Matx33d& warp) {
    constexpr int kMaxSteps = 40;
    constexpr double kSettled = 2e-3, kAlmostSettled = 5e-2, kMaxStep = 0.25;  // px, px, half sides
    for (int i = 0; i < kMaxSteps; ++i) {
      if (!Linearise(warp)) return false;
      const Eigen::VectorXd d = solution_.head(count_) / solution_[count_];
      const double longest = d.cwiseAbs().maxCoeff();
      if (!(longest < 2.0) || !(solution_[count_] > 0.0)) return false;
      warp = ApplyChange(warp, patch_, std::min(1.0, kMaxStep / longest) * d);
      const double moved_px = longest * HalfSide(patch_);
      if (moved_px < (i + 1 < kMaxSteps ? kSettled : kAlmostSettled)) return Linearise(warp);
    }
    return false;
  }

  /// Returns the alignment after Run(), with the covariance C = s^2 c (a J' W J a)^-1. s^2 is the
  /// variance of e. c accounts for the correlation of neighbouring errors: it is the product of (1
  /// + q) / (1 - q) for rows and for columns. q is the correlation of neighbouring values of e.
  Alignment Result(const cv::Matx33d& warp) const {
    double squares = 0.0, weights = 0.0, along_rows = 0.0, along_columns = 0.0;
    for (int y = 1; y < patch_.rows - 1; ++y) {
      for (int x = 1; x < patch_.cols - 1; ++x) {
        if (!IsUsable(y, x)) continue;
        const double e = ResidualAt(y, x), weight = Weight(e);
        squares += weight * e * e;
        weights += weight;
        if (IsUsable(y, x + 1)) along_rows += weight * e * ResidualAt(y, x + 1);
        if (IsUsable(y + 1, x)) along_columns += weight * e * ResidualAt(y + 1, x);
      }
    }
    constexpr double kRounding = 1.0 / 12.0;  // variance of the rounding of a grey value
    double variance = squares / weights + kRounding;
    for (const double products : {along_rows, along_columns}) {
      const double q = std::clamp(products / (squares + 1e-9), 0.0, 0.95);
      variance *= (1.0 + q) / (1.0 - q);
    }
    const Eigen::MatrixXd identity = Eigen::MatrixXd::Identity(count_ + 2, count_ + 2);
    variance /= solution_[count_] * solution_[count_];
    return {warp, Similarity(), variance * solver_.solve(identity).topLeftCorner(count_, count_)};
  }

 private:
  static constexpr float kOutside = -1e6F;  ///< grey value that marks pixels outside the image

  bool IsUsable(int y, int x) const {
    return x > 0 && y > 0 && x < patch_.cols - 1 && y < patch_.rows - 1 &&
           sampled_.at<float>(y, x) > -1.0F && std::abs(right_.at<float>(y, x)) < 1e3F &&
           std::abs(down_.at<float>(y, x)) < 1e3F;
  }
  double ResidualAt(int y, int x) const {
    return double(patch_.at<float>(y, x)) - solution_[count_] * double(sampled_.at<float>(y, x)) -
           solution_[count_ + 1];
  }
  double Weight(double error) const {
    constexpr double kHuber = 1.345;
    return std::abs(error) <= kHuber * spread_ ? 1.0 : kHuber * spread_ / std::abs(error);
  }

  /// Samples the image at each pixel of the patch. Does not use cv::warpPerspective, because this
  /// function rounds positions to 1/32 px, which prevents convergence.
  void Sample(const cv::Matx33d& warp) {
    sampled_.create(patch_.size(), CV_32F);
    const int last_column = image_.cols - 2, last_row = image_.rows - 2;
    for (int y = 0; y < patch_.rows; ++y) {
      auto* const destination = sampled_.ptr<float>(y);
      for (int x = 0; x < patch_.cols; ++x) {
        const cv::Point2d point = Apply(warp, {double(x), double(y)});
        destination[x] = kOutside;
        if (!(point.x >= 0.0 && point.y >= 0.0 && point.x < image_.cols && point.y < image_.rows))
          continue;
        const int column = static_cast<int>(point.x), row = static_cast<int>(point.y);
        if (column > last_column || row > last_row) continue;
        const auto a = static_cast<float>(point.x - column), b = static_cast<float>(point.y - row);
        const float* const upper = image_.ptr<float>(row) + column;
        const float* const lower = image_.ptr<float>(row + 1) + column;
        destination[x] = (1.0F - b) * ((1.0F - a) * upper[0] + a * upper[1]) +
                         b * ((1.0F - a) * lower[0] + a * lower[1]);
      }
    }
  }

  /// Solves for d, a and b at `warp`.
  bool Linearise(const cv::Matx33d& warp) {
    Sample(warp);
    cv::Sobel(sampled_, right_, CV_32F, 1, 0, 3, 0.125);
    cv::Sobel(sampled_, down_, CV_32F, 0, 1, 3, 0.125);
    const cv::Point2d middle = Middle(patch_);
    const double half = HalfSide(patch_);
    const bool weighted = solution_.size() > 0;
    if (weighted) EstimateSpread();
    Eigen::Matrix<double, 10, 10> normal = Eigen::Matrix<double, 10, 10>::Zero();
    Eigen::Matrix<double, 10, 1> right = Eigen::Matrix<double, 10, 1>::Zero(), row = right;
    const int n = count_ + 2;
    int usable_count = 0;
    for (int y = 1; y < patch_.rows - 1; ++y) {
      for (int x = 1; x < patch_.cols - 1; ++x) {
        if (!IsUsable(y, x)) continue;
        const double gx = half * double(right_.at<float>(y, x));
        const double gy = half * double(down_.at<float>(y, x));
        const double px = (x - middle.x) / half, py = (y - middle.y) / half;
        const double radial = gx * px + gy * py;
        const double columns[8] = {radial,       gy * px - gx * py, gx,
                                   gy,           gx * px - gy * py, gx * py + gy * px,
                                   -radial * px, -radial * py};
        for (int i = 0; i < count_; ++i) row[i] = columns[i];
        row[count_] = double(sampled_.at<float>(y, x));
        row[count_ + 1] = 1.0;
        const double grey = double(patch_.at<float>(y, x));
        const double weight = weighted ? Weight(ResidualAt(y, x)) : 1.0;
        for (int i = 0; i < n; ++i) {
          const double weighted_value = weight * row[i];
          for (int j = 0; j <= i; ++j) normal(i, j) += weighted_value * row[j];
          right[i] += weighted_value * grey;
        }
        ++usable_count;
      }
    }
    if (2 * usable_count < (patch_.rows - 2) * (patch_.cols - 2)) return false;
    const Eigen::MatrixXd lower = normal.topLeftCorner(n, n).selfadjointView<Eigen::Lower>();
    solver_.compute(lower);
    if (solver_.info() != Eigen::Success || !solver_.isPositive() || solver_.rcond() < 1e-14) {
      return false;
    }
    solution_ = solver_.solve(right.head(n));
    return solution_.allFinite();
  }

  /// Sets the spread to 1.4826 median |e|, with a and b of the last solution.
  void EstimateSpread() {
    errors_.clear();
    for (int y = 1; y < patch_.rows - 1; y += 2) {
      for (int x = 1; x < patch_.cols - 1; x += 2) {
        if (IsUsable(y, x)) errors_.push_back(std::abs(ResidualAt(y, x)));
      }
    }
    if (errors_.empty()) return;
    const auto middle = errors_.begin() + std::ssize(errors_) / 2;
    std::ranges::nth_element(errors_, middle);
    spread_ = std::max(1.4826 * *middle, 0.5);
  }

  /// Returns the correlation of the patch and the sampled image, in [-1, 1].
  double Similarity() const {
    double n = 0.0, a = 0.0, b = 0.0, sum_aa = 0.0, sum_bb = 0.0, sum_ab = 0.0;
    for (int y = 1; y < patch_.rows - 1; ++y) {
      for (int x = 1; x < patch_.cols - 1; ++x) {
        if (!IsUsable(y, x)) continue;
        const double p = double(patch_.at<float>(y, x)), s = double(sampled_.at<float>(y, x));
        n += 1.0;
        a += p;
        b += s;
        sum_aa += p * p;
        sum_bb += s * s;
        sum_ab += p * s;
      }
    }
    const double variances = (sum_aa - a * a / n) * (sum_bb - b * b / n);
    return variances > 0.0 ? (sum_ab - a * b / n) / std::sqrt(variances) : 0.0;
  }

  const cv::Mat& patch_;
  const cv::Mat& image_;
  int count_;
  cv::Mat sampled_, right_, down_;  ///< image at the pixels of the patch, and its gradient
  Eigen::VectorXd solution_;        ///< a d, followed by a and b
  double spread_ = 1.0;             ///< standard deviation of e, in grey levels
  Eigen::LDLT<Eigen::MatrixXd> solver_;
  std::vector<double> errors_;
};

/// Finds `patch` in `image` to a fraction of a pixel, starting from `warp`. Both have grey values
/// of type float. Brightness and contrast may change. If the alignment does not converge, or the
/// similarity is low, patch and image are first aligned at a quarter of their size. This alignment
/// converges from a larger distance. The full-size alignment is then repeated from the result of
/// the small one. Returns nullopt if PatchAlignment::Run() fails for both starts.
inline std::optional<Alignment> Align(const cv::Mat& patch, const cv::Mat& image,
                                      const cv::Matx33d& warp, Warp kind) {
  constexpr int kShrink = 4, kMinSide = 16;
  constexpr double kMinSimilarity = 0.95;
  const auto align_from = [&](cv::Matx33d initial_warp) -> std::optional<Alignment> {
    PatchAlignment alignment(patch, image, kind);
    if (!alignment.Run(initial_warp)) return std::nullopt;
    return alignment.Result(initial_warp);
  };
  const cv::Matx33d start = ReduceTo(warp, patch, kind);
  const std::optional<Alignment> full_result = align_from(start);
  if (full_result && full_result->similarity >= kMinSimilarity) return full_result;
  if (std::min(patch.cols, patch.rows) < kShrink * kMinSide) return full_result;
  constexpr double k = kShrink, kOffset = 0.5 * (kShrink - 1);
  const cv::Matx33d from_small(k, 0.0, kOffset, 0.0, k, kOffset, 0.0, 0.0, 1.0);
  cv::Mat small_patch, small_image;
  cv::resize(patch, small_patch, {}, 1.0 / k, 1.0 / k, cv::INTER_AREA);
  cv::resize(image, small_image, {}, 1.0 / k, 1.0 / k, cv::INTER_AREA);
  cv::Matx33d small = from_small.inv() * start * from_small;
  if (!PatchAlignment(small_patch, small_image, kind).Run(small)) return full_result;
  const std::optional<Alignment> coarse_result = align_from(from_small * small * from_small.inv());
  return coarse_result && (!full_result || coarse_result->similarity > full_result->similarity)
             ? coarse_result
             : full_result;
}

}  // namespace alidade
