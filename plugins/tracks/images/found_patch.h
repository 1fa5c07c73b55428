// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace alidade {

/// The patch about a feature where it was found, to which it is aligned in each image, so that the
/// errors of following it from image to image do not add up. All that does not depend on the image
/// is prepared once: the inverse compositional algorithm [Baker2004],
///
///   e(x) = a seen(A x + t) + b - patch(x),   d = (J' J)^-1 J' e,   (A, t) <- (A, t) (I + D)^-1
///
/// with x counted from the middle of the patch, in units of half its side, J the derivative of the
/// patch by the six numbers of D, without the part that a change of light explains, and a and b
/// those that give `seen` the mean and the variance of the patch.
class FoundPatch {
 public:
  FoundPatch() = default;
  /// `side` odd; the patch lies on the image.
  FoundPatch(const cv::Mat& image, cv::Point2f middle, int side) : side_(side) {
    cv::Mat around;
    cv::getRectSubPix(image, cv::Size(side + 2, side + 2), middle, around, CV_32F);
    const int n = side * side;
    const float half = 0.5F * static_cast<float>(side - 1);
    patch_.resize(n);
    jacobian_.resize(n, 6);
    for (int y = 0; y < side; ++y) {
      const float* const row = around.ptr<float>(y + 1) + 1;
      const float* const above = around.ptr<float>(y) + 1;
      const float* const below = around.ptr<float>(y + 2) + 1;
      for (int x = 0; x < side; ++x) {
        const float gx = 0.5F * (row[x + 1] - row[x - 1]), gy = 0.5F * (below[x] - above[x]);
        const float px = static_cast<float>(x) / half - 1.0F,
                    py = static_cast<float>(y) / half - 1.0F;
        const int i = y * side + x;
        patch_[i] = row[x];
        jacobian_.row(i) << gx * px, gx * py, gx, gy * px, gy * py, gy;
      }
    }
    jacobian_ *= half;
    patch_.array() -= patch_.mean();
    length_ = patch_.norm();
    const Eigen::VectorXf unit = patch_ / std::max(length_, 1e-6F);
    jacobian_.rowwise() -= jacobian_.colwise().mean().eval();
    jacobian_ -= unit * (unit.transpose() * jacobian_).eval();
    const Eigen::Matrix<float, 6, 6> normal = jacobian_.transpose() * jacobian_;
    // Where the texture does not tell of a change, as of the turn of a disc, there is none.
    constexpr float kWeak = 1e-3F;
    using Matrix6 = Eigen::Matrix<float, 6, 6>;
    const Matrix6 damped = normal + kWeak * normal.trace() / 6.0F * Matrix6::Identity();
    inverse_ = damped.ldlt().solve(Matrix6::Identity());
    shape_ << half, 0.0F, 0.0F, half;
  }

  /// Moves from `at`, px, to where the patch is in `image`, 8 bit grey, and keeps its shape there.
  /// False where it does not settle or leaves the image; then all is as before.
  bool Align(const cv::Mat& image, cv::Point2f& at) {
    constexpr int kMost = 15;
    constexpr float kSettled = 1e-3F, kNearly = 1e-2F;  // px; after as many steps as there may be
    Eigen::Matrix2f shape = shape_;
    Eigen::Vector2f place(at.x, at.y);
    for (int k = 0; k < kMost; ++k) {
      if (!Look(image, shape, place)) return false;
      const Eigen::Matrix<float, 6, 1> d = inverse_ * (jacobian_.transpose() * (seen_ - patch_));
      Eigen::Matrix3f change;
      change << 1.0F + d[0], d[1], d[2], d[3], 1.0F + d[4], d[5], 0.0F, 0.0F, 1.0F;
      const Eigen::Matrix3f back = change.inverse();
      place += shape * back.topRightCorner<2, 1>();
      shape = shape * back.topLeftCorner<2, 2>();
      const float largest = d.cwiseAbs().maxCoeff();
      if (!(largest < 0.5F)) return false;
      if (largest * 0.5F * static_cast<float>(side_ - 1) < (k + 1 < kMost ? kSettled : kNearly)) {
        shape_ = shape;
        at = {place[0], place[1]};
        return true;
      }
    }
    return false;
  }

  /// Correlation with what is seen at `at` under the shape of the last alignment, in [-1, 1]; -1
  /// off the image.
  float Similarity(const cv::Mat& image, cv::Point2f at) {
    if (!Look(image, shape_, {at.x, at.y}) || !(length_ > 0.0F)) return -1.0F;
    return seen_.dot(patch_) / (length_ * length_);
  }

 private:
  /// `seen_`: with the mean and the variance of the patch. False off the image.
  bool Look(const cv::Mat& image, const Eigen::Matrix2f& shape, const Eigen::Vector2f& place) {
    const Eigen::Vector2f reach = shape.cwiseAbs().rowwise().sum();
    if (!(place[0] - reach[0] >= 0.0F && place[1] - reach[1] >= 0.0F &&
          place[0] + reach[0] < static_cast<float>(image.cols - 1) &&
          place[1] + reach[1] < static_cast<float>(image.rows - 1))) {
      return false;
    }
    seen_.resize(patch_.size());
    const Eigen::Matrix2f step = shape * (2.0F / static_cast<float>(side_ - 1));
    const Eigen::Vector2f corner = place - shape.rowwise().sum();
    for (int y = 0; y < side_; ++y) {
      float u = corner[0] + static_cast<float>(y) * step(0, 1);
      float v = corner[1] + static_cast<float>(y) * step(1, 1);
      float* const to = seen_.data() + y * side_;
      for (int x = 0; x < side_; ++x, u += step(0, 0), v += step(1, 0)) {
        // Rounding may put the rim a hair off the image.
        const int column = std::clamp(static_cast<int>(u), 0, image.cols - 2);
        const int row = std::clamp(static_cast<int>(v), 0, image.rows - 2);
        const float a = u - static_cast<float>(column), b = v - static_cast<float>(row);
        const unsigned char* const upper = image.ptr<unsigned char>(row) + column;
        const unsigned char* const lower = image.ptr<unsigned char>(row + 1) + column;
        const float over =
            static_cast<float>(upper[0]) + a * static_cast<float>(upper[1] - upper[0]);
        const float under =
            static_cast<float>(lower[0]) + a * static_cast<float>(lower[1] - lower[0]);
        to[x] = over + b * (under - over);
      }
    }
    seen_.array() -= seen_.mean();
    const float length = seen_.norm();
    if (!(length > 0.0F)) return false;
    seen_ *= length_ / length;
    return true;
  }

  int side_ = 0;
  Eigen::VectorXf patch_;  ///< its mean taken off
  float length_ = 0.0F;    ///< of patch_
  Eigen::Matrix<float, Eigen::Dynamic, 6> jacobian_;
  Eigen::Matrix<float, 6, 6> inverse_ = Eigen::Matrix<float, 6, 6>::Zero();  ///< of J' J
  Eigen::Matrix2f shape_ =
      Eigen::Matrix2f::Zero();  ///< from units of half the side to px of the image
  Eigen::VectorXf seen_;
};

}  // namespace alidade
