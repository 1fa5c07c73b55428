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

/// How a patch may change from image to image; each may do what those before it do.
enum class Warp { kSimilarity, kAffine, kHomography };

/// Numbers of small changes of a warp.
inline int CountOf(Warp kind) { return 4 + 2 * static_cast<int>(kind); }

/// Where a point of the patch, px, is in the image, px.
inline cv::Point2d Apply(const cv::Matx33d& warp, cv::Point2d at) {
  const cv::Vec3d to = warp * cv::Vec3d(at.x, at.y, 1.0);
  return {to[0] / to[2], to[1] / to[2]};
}

inline cv::Point2d Middle(const cv::Mat& patch) {
  return {0.5 * (patch.cols - 1), 0.5 * (patch.rows - 1)};
}
/// Half the longer side of a patch: the unit of length of small changes.
inline double HalfSide(const cv::Mat& patch) { return 0.5 * std::max(patch.cols, patch.rows); }

/// warp U (I + sum_i d_i E_i) U^-1: small changes d of the patch in coordinates that are 0 in its
/// middle and 1 at its edge (U takes them to pixels). E_0 to E_7: size, turn, shift right, shift
/// down, stretch, shear, and the two projective ones.
inline cv::Matx33d Changed(const cv::Matx33d& warp, const cv::Mat& patch,
                           const Eigen::Ref<const Eigen::VectorXd>& d) {
  std::array<double, 8> all{};
  std::ranges::copy(d, all.begin());
  const auto& [size, turn, right, down, stretch, shear, tilt_x, tilt_y] = all;
  const cv::Matx33d change(1.0 + size + stretch, -turn + shear, right, turn + shear,
                           1.0 + size - stretch, down, tilt_x, tilt_y, 1.0);
  const cv::Point2d middle = Middle(patch);
  const double half = HalfSide(patch);
  const cv::Matx33d to_pixels(half, 0.0, middle.x, 0.0, half, middle.y, 0.0, 0.0, 1.0);
  cv::Matx33d changed = warp * to_pixels * change * to_pixels.inv();
  return changed * (1.0 / changed(2, 2));
}

/// The nearest warp of that kind, at the middle of the patch.
inline cv::Matx33d Reduced(const cv::Matx33d& warp, const cv::Mat& patch, Warp kind) {
  if (kind == Warp::kHomography) return warp;
  const cv::Point2d middle = Middle(patch), at = Apply(warp, middle);
  const cv::Point2d right =
      Apply(warp, middle + cv::Point2d(0.5, 0.0)) - Apply(warp, middle - cv::Point2d(0.5, 0.0));
  const cv::Point2d down =
      Apply(warp, middle + cv::Point2d(0.0, 0.5)) - Apply(warp, middle - cv::Point2d(0.0, 0.5));
  cv::Matx22d a(right.x, down.x, right.y, down.y);
  if (kind == Warp::kSimilarity) {
    const double size = 0.5 * (a(0, 0) + a(1, 1)), turn = 0.5 * (a(1, 0) - a(0, 1));
    a = cv::Matx22d(size, -turn, turn, size);
  }
  return {a(0, 0), a(0, 1), at.x - a(0, 0) * middle.x - a(0, 1) * middle.y,
          a(1, 0), a(1, 1), at.y - a(1, 0) * middle.x - a(1, 1) * middle.y,
          0.0,     0.0,     1.0};
}

/// d (area in the image) / d (area of the patch) at a point of the patch.
inline double AreaAt(const cv::Matx33d& warp, cv::Point2d at) {
  const double w = warp(2, 0) * at.x + warp(2, 1) * at.y + warp(2, 2);
  return std::abs(cv::determinant(warp) / (w * w * w));
}

/// A patch that was found in an image.
struct Alignment {
  cv::Matx33d warp;            ///< from pixels of the patch to pixels of the image
  double similarity;           ///< correlation of the two, in [-1, 1]
  Eigen::MatrixXd covariance;  ///< of d in Changed()

  /// Variance of a number that follows from the warp: g C g', g its gradient by differences.
  double Variance(const cv::Mat& patch,
                  const std::function<double(const cv::Matx33d&)>& number) const {
    constexpr double kStep = 1e-5;
    Eigen::VectorXd gradient(covariance.rows());
    for (int i = 0; i < gradient.size(); ++i) {
      const Eigen::VectorXd step = kStep * Eigen::VectorXd::Unit(gradient.size(), i);
      gradient[i] = (number(Changed(warp, patch, step)) - number(Changed(warp, patch, -step))) /
                    (2.0 * kStep);
    }
    return gradient.dot(covariance * gradient);
  }
};

/// One patch that is being aligned in one image [Baker2004], both grey as float:
///
///   patch(x) = a (seen(x; warp) + J d) + b + e,   J = d seen / d d
///
/// is solved for the change d of the warp and the light (a, b) by weighted least squares, until d
/// is small. (With a and b on the patch's side a warp to any flat place would do, with a = 0.)
/// Pixels with a large e, by Huber's loss, count less: of what is in front of the target.
class PatchAlignment {
 public:
  PatchAlignment(const cv::Mat& patch, const cv::Mat& image, Warp kind)
      : patch_(patch), image_(image), count_(CountOf(kind)) {}

  /// False where it does not settle, less than half of it is on the image, or it has no texture.
  bool Run(cv::Matx33d& warp) {
    constexpr int kMaxSteps = 40;
    constexpr double kSettled = 2e-3, kNearly = 5e-2, kMaxStep = 0.25;  // px, px, of the half side
    for (int i = 0; i < kMaxSteps; ++i) {
      if (!Linearise(warp)) return false;
      const Eigen::VectorXd d = solution_.head(count_) / solution_[count_];
      const double longest = d.cwiseAbs().maxCoeff();
      if (!(longest < 2.0) || !(solution_[count_] > 0.0)) return false;
      warp = Changed(warp, patch_, std::min(1.0, kMaxStep / longest) * d);
      const double moved_px = longest * HalfSide(patch_);
      if (moved_px < (i + 1 < kMaxSteps ? kSettled : kNearly)) return Linearise(warp);
    }
    return false;
  }

  /// After Run(): with the covariance C = s^2 c (a J' W J a)^-1, s^2 the variance of e, and
  /// c = (1 + q) / (1 - q) for the correlation q of neighbours in e, along rows and along columns:
  /// errors that come in blobs average out less.
  Alignment Result(const cv::Matx33d& warp) const {
    double squares = 0.0, weights = 0.0, along_rows = 0.0, along_columns = 0.0;
    for (int y = 1; y < patch_.rows - 1; ++y) {
      for (int x = 1; x < patch_.cols - 1; ++x) {
        if (!Usable(y, x)) continue;
        const double e = Error(y, x), weight = Weight(e);
        squares += weight * e * e;
        weights += weight;
        if (Usable(y, x + 1)) along_rows += weight * e * Error(y, x + 1);
        if (Usable(y + 1, x)) along_columns += weight * e * Error(y + 1, x);
      }
    }
    constexpr double kRounding = 1.0 / 12.0;  // variance of a grey value's
    double variance = squares / weights + kRounding;
    for (const double products : {along_rows, along_columns}) {
      const double q = std::clamp(products / (squares + 1e-9), 0.0, 0.95);
      variance *= (1.0 + q) / (1.0 - q);
    }
    const Eigen::MatrixXd all = Eigen::MatrixXd::Identity(count_ + 2, count_ + 2);
    variance /= solution_[count_] * solution_[count_];
    return {warp, Similarity(), variance * solver_.solve(all).topLeftCorner(count_, count_)};
  }

 private:
  static constexpr float kOutside = -1e6F;  ///< grey beyond the image

  bool Usable(int y, int x) const {
    return x > 0 && y > 0 && x < patch_.cols - 1 && y < patch_.rows - 1 &&
           seen_.at<float>(y, x) > -1.0F && std::abs(right_.at<float>(y, x)) < 1e3F &&
           std::abs(down_.at<float>(y, x)) < 1e3F;
  }
  double Error(int y, int x) const {
    return double(patch_.at<float>(y, x)) - solution_[count_] * double(seen_.at<float>(y, x)) -
           solution_[count_ + 1];
  }
  double Weight(double error) const {
    constexpr double kHuber = 1.345;
    return std::abs(error) <= kHuber * spread_ ? 1.0 : kHuber * spread_ / std::abs(error);
  }

  /// What is seen at each pixel of the patch. cv::warpPerspective rounds places to 1/32 px, in
  /// which the alignment would not settle.
  void Sample(const cv::Matx33d& warp) {
    seen_.create(patch_.size(), CV_32F);
    const int last_column = image_.cols - 2, last_row = image_.rows - 2;
    for (int y = 0; y < patch_.rows; ++y) {
      auto* const to = seen_.ptr<float>(y);
      for (int x = 0; x < patch_.cols; ++x) {
        const cv::Point2d at = Apply(warp, {double(x), double(y)});
        to[x] = kOutside;
        if (!(at.x >= 0.0 && at.y >= 0.0 && at.x < image_.cols && at.y < image_.rows)) continue;
        const int column = static_cast<int>(at.x), row = static_cast<int>(at.y);
        if (column > last_column || row > last_row) continue;
        const auto a = static_cast<float>(at.x - column), b = static_cast<float>(at.y - row);
        const float* const upper = image_.ptr<float>(row) + column;
        const float* const lower = image_.ptr<float>(row + 1) + column;
        to[x] = (1.0F - b) * ((1.0F - a) * upper[0] + a * upper[1]) +
                b * ((1.0F - a) * lower[0] + a * lower[1]);
      }
    }
  }

  /// Solves for d, a and b at `warp`.
  bool Linearise(const cv::Matx33d& warp) {
    Sample(warp);
    cv::Sobel(seen_, right_, CV_32F, 1, 0, 3, 0.125);
    cv::Sobel(seen_, down_, CV_32F, 0, 1, 3, 0.125);
    const cv::Point2d middle = Middle(patch_);
    const double half = HalfSide(patch_);
    const bool weighted = solution_.size() > 0;
    if (weighted) FindSpread();
    Eigen::Matrix<double, 10, 10> normal = Eigen::Matrix<double, 10, 10>::Zero();
    Eigen::Matrix<double, 10, 1> right = Eigen::Matrix<double, 10, 1>::Zero(), row = right;
    const int n = count_ + 2;
    int used = 0;
    for (int y = 1; y < patch_.rows - 1; ++y) {
      for (int x = 1; x < patch_.cols - 1; ++x) {
        if (!Usable(y, x)) continue;
        const double gx = half * double(right_.at<float>(y, x));
        const double gy = half * double(down_.at<float>(y, x));
        const double px = (x - middle.x) / half, py = (y - middle.y) / half;
        const double along = gx * px + gy * py;
        const double columns[8] = {along,       gy * px - gx * py, gx,
                                   gy,          gx * px - gy * py, gx * py + gy * px,
                                   -along * px, -along * py};
        for (int i = 0; i < count_; ++i) row[i] = columns[i];
        row[count_] = double(seen_.at<float>(y, x));
        row[count_ + 1] = 1.0;
        const double grey = double(patch_.at<float>(y, x));
        const double weight = weighted ? Weight(Error(y, x)) : 1.0;
        for (int i = 0; i < n; ++i) {
          const double own = weight * row[i];
          for (int j = 0; j <= i; ++j) normal(i, j) += own * row[j];
          right[i] += own * grey;
        }
        ++used;
      }
    }
    if (2 * used < (patch_.rows - 2) * (patch_.cols - 2)) return false;
    const Eigen::MatrixXd lower = normal.topLeftCorner(n, n).selfadjointView<Eigen::Lower>();
    solver_.compute(lower);
    if (solver_.info() != Eigen::Success || !solver_.isPositive() || solver_.rcond() < 1e-14) {
      return false;
    }
    solution_ = solver_.solve(right.head(n));
    return solution_.allFinite();
  }

  /// 1.4826 median |e|, with the light of the last solution.
  void FindSpread() {
    errors_.clear();
    for (int y = 1; y < patch_.rows - 1; y += 2) {
      for (int x = 1; x < patch_.cols - 1; x += 2) {
        if (Usable(y, x)) errors_.push_back(std::abs(Error(y, x)));
      }
    }
    if (errors_.empty()) return;
    const auto middle = errors_.begin() + std::ssize(errors_) / 2;
    std::ranges::nth_element(errors_, middle);
    spread_ = std::max(1.4826 * *middle, 0.5);
  }

  /// Correlation of the patch and what is seen at it, in [-1, 1].
  double Similarity() const {
    double n = 0.0, a = 0.0, b = 0.0, aa = 0.0, bb = 0.0, ab = 0.0;
    for (int y = 1; y < patch_.rows - 1; ++y) {
      for (int x = 1; x < patch_.cols - 1; ++x) {
        if (!Usable(y, x)) continue;
        const double p = double(patch_.at<float>(y, x)), s = double(seen_.at<float>(y, x));
        n += 1.0;
        a += p;
        b += s;
        aa += p * p;
        bb += s * s;
        ab += p * s;
      }
    }
    const double variances = (aa - a * a / n) * (bb - b * b / n);
    return variances > 0.0 ? (ab - a * b / n) / std::sqrt(variances) : 0.0;
  }

  const cv::Mat& patch_;
  const cv::Mat& image_;
  int count_;
  cv::Mat seen_, right_, down_;  ///< what is seen at the patch, and its gradient per pixel of it
  Eigen::VectorXd solution_;     ///< a d, a, b
  double spread_ = 1.0;          ///< standard deviation of e, grey
  Eigen::LDLT<Eigen::MatrixXd> solver_;
  std::vector<double> errors_;
};

/// Finds `patch` near where `warp` puts it in `image`, both grey as float, to a fraction of a
/// pixel. Brightness and contrast may change. Where that does not settle, or on what is hardly
/// alike, it is tried again from where the same images a quarter as large settle, which may be
/// farther off. None where PatchAlignment::Run() fails in both.
inline std::optional<Alignment> Align(const cv::Mat& patch, const cv::Mat& image,
                                      const cv::Matx33d& warp, Warp kind) {
  constexpr int kShrink = 4, kMinSide = 16;
  constexpr double kAlike = 0.95;
  const auto settle = [&](cv::Matx33d from) -> std::optional<Alignment> {
    PatchAlignment alignment(patch, image, kind);
    if (!alignment.Run(from)) return std::nullopt;
    return alignment.Result(from);
  };
  const cv::Matx33d start = Reduced(warp, patch, kind);
  const std::optional<Alignment> near = settle(start);
  if (near && near->similarity >= kAlike) return near;
  if (std::min(patch.cols, patch.rows) < kShrink * kMinSide) return near;
  constexpr double k = kShrink, kOffset = 0.5 * (kShrink - 1);
  const cv::Matx33d from_small(k, 0.0, kOffset, 0.0, k, kOffset, 0.0, 0.0, 1.0);
  cv::Mat small_patch, small_image;
  cv::resize(patch, small_patch, {}, 1.0 / k, 1.0 / k, cv::INTER_AREA);
  cv::resize(image, small_image, {}, 1.0 / k, 1.0 / k, cv::INTER_AREA);
  cv::Matx33d small = from_small.inv() * start * from_small;
  if (!PatchAlignment(small_patch, small_image, kind).Run(small)) return near;
  const std::optional<Alignment> far = settle(from_small * small * from_small.inv());
  return far && (!near || far->similarity > near->similarity) ? far : near;
}

}  // namespace alidade
