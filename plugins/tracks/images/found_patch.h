// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdint>
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
/// those that give `seen` the mean and the variance of the patch. J has no part along 1 and along
/// the patch, so J' e = a J' seen.
class FoundPatch {
 public:
  FoundPatch() = default;
  /// `side` odd, at most 101; the patch lies on the image.
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
    const Matrix6 normal = jacobian_.transpose() * jacobian_;
    // Where the texture does not tell of a change, as of the turn of a disc, there is none.
    constexpr float kWeak = 1e-3F;
    const Matrix6 damped = normal + kWeak * normal.trace() / 6.0F * Matrix6::Identity();
    inverse_ = damped.ldlt().solve(Matrix6::Identity());
    influence_.resize(n, 2);
    influence_.col(0) = jacobian_ * inverse_.col(2);
    influence_.col(1) = jacobian_ * inverse_.col(5);
    shape_ << half, 0.0F, 0.0F, half;
  }

  /// Moves from `at`, px, to where the patch is in `image`, 8 bit grey, and keeps its shape there.
  /// False where it does not settle, leaves the image, or correlates less than `least_similarity`
  /// with what is there; then all is as before.
  bool Align(const cv::Mat& image, float least_similarity, cv::Point2f& at) {
    constexpr int kMost = 15;
    constexpr float kSettled = 4e-3F;  // px; a step is a tenth of the one before it, or less
    Eigen::Matrix2f shape = shape_;
    Eigen::Vector2f place(at.x, at.y);
    for (int k = 0; k < kMost; ++k) {
      if (!Look(image, shape, place)) return false;
      const Vector6 d = gain_ * (inverse_ * (jacobian_.transpose() * seen_));
      Eigen::Matrix3f change;
      change << 1.0F + d[0], d[1], d[2], d[3], 1.0F + d[4], d[5], 0.0F, 0.0F, 1.0F;
      const Eigen::Matrix3f back = change.inverse();
      place += shape * back.topRightCorner<2, 1>();
      shape = shape * back.topLeftCorner<2, 2>();
      const float largest = d.cwiseAbs().maxCoeff();
      if (!(largest < 0.5F)) return false;
      if (largest * 0.5F * static_cast<float>(side_ - 1) < kSettled) {
        if (Similarity() < least_similarity) return false;
        shape_ = shape;
        at = {place[0], place[1]};
        return true;
      }
    }
    return false;
  }

  /// Correlation with what was seen at the end of the last alignment, in [-1, 1].
  float Similarity() const { return gain_ * seen_.dot(patch_) / (length_ * length_); }

  /// Covariance of the place that the last alignment found, px^2, from what does not fit: with e
  /// the place is moved by t = sum k e, and what one pixel of e is says something of those near
  /// it, so
  ///
  ///   C = A (sum over cells of (sum k e) (sum k e)') A',   k = [(J' J)^-1 J']_t
  ///
  /// with cells of a fifth of the side: consistent however e is correlated within a cell
  /// [Liang1986]. A patch across an edge of depth, parts of which move by themselves, has a large
  /// one. Zero before the first alignment.
  Eigen::Matrix2f Covariance() const {
    constexpr int kCells = 5;
    Eigen::Matrix2f sum = Eigen::Matrix2f::Zero();
    if (seen_.size() == 0) return sum;
    const auto edge = [&](int cell) { return cell * side_ / kCells; };
    for (int row = 0; row < kCells; ++row) {
      Eigen::Matrix<float, 2, kCells> moved = Eigen::Matrix<float, 2, kCells>::Zero();
      for (int y = edge(row); y < edge(row + 1); ++y) {
        for (int column = 0; column < kCells; ++column) {
          for (int i = y * side_ + edge(column); i < y * side_ + edge(column + 1); ++i) {
            const float e = gain_ * (seen_[i] - mean_) - patch_[i];
            moved(0, column) += influence_(i, 0) * e;
            moved(1, column) += influence_(i, 1) * e;
          }
        }
      }
      sum += moved * moved.transpose();
    }
    return shape_ * sum * shape_.transpose();
  }

 private:
  using Matrix6 = Eigen::Matrix<float, 6, 6>;
  using Vector6 = Eigen::Matrix<float, 6, 1>;

  /// Fills `seen_` with what is at `place`, and `gain_` with what gives it the variance of the
  /// patch. False off the image.
  bool Look(const cv::Mat& image, const Eigen::Matrix2f& shape, const Eigen::Vector2f& place) {
    // Rounding puts the rim a hair farther out.
    const Eigen::Vector2f reach = shape.cwiseAbs().rowwise().sum().array() + 0.01F;
    if (!(place[0] - reach[0] >= 0.0F && place[1] - reach[1] >= 0.0F &&
          place[0] + reach[0] < static_cast<float>(image.cols - 1) &&
          place[1] + reach[1] < static_cast<float>(image.rows - 1))) {
      return false;
    }
    seen_.resize(patch_.size());
    const Eigen::Matrix2f step = shape * (2.0F / static_cast<float>(side_ - 1));
    const Eigen::Vector2f corner = place - shape.rowwise().sum();
    for (int y = 0; y < side_; ++y) {
      LookAlong(image, corner + static_cast<float>(y) * step.col(1), step.col(0),
                seen_.data() + y * side_);
    }
    mean_ = seen_.mean();
    const float length = std::sqrt((seen_.array() - mean_).square().sum());
    if (!(length > 0.0F && length_ > 0.0F)) return false;
    gain_ = length_ / length;
    return true;
  }

  /// A row of `seen_`, by bilinear interpolation. What can go by vectors is in loops of its own.
  void LookAlong(const cv::Mat& image, Eigen::Vector2f from, Eigen::Vector2f step,
                 float* to) const {
    float right[kMostSide], down[kMostSide];
    int offset[kMostSide];
    std::uint16_t upper[kMostSide], lower[kMostSide];  // two pixels each
    const auto stride = static_cast<int>(image.step[0]);
    for (int x = 0; x < side_; ++x) {
      const float u = from[0] + static_cast<float>(x) * step[0];
      const float v = from[1] + static_cast<float>(x) * step[1];
      const int column = static_cast<int>(u), row = static_cast<int>(v);
      right[x] = u - static_cast<float>(column);
      down[x] = v - static_cast<float>(row);
      offset[x] = row * stride + column;
    }
    const unsigned char* const grey = image.ptr<unsigned char>();
    for (int x = 0; x < side_; ++x) {
      const unsigned char* const over = grey + offset[x];
      const unsigned char* const under = over + stride;
      upper[x] = static_cast<std::uint16_t>(over[0] | over[1] << 8);
      lower[x] = static_cast<std::uint16_t>(under[0] | under[1] << 8);
    }
    for (int x = 0; x < side_; ++x) {
      const auto mix = [&](int pair) {
        const int first = pair & 255, second = pair >> 8;
        return static_cast<float>(first) + right[x] * static_cast<float>(second - first);
      };
      const float over = mix(upper[x]), under = mix(lower[x]);
      to[x] = over + down[x] * (under - over);
    }
  }

  static constexpr int kMostSide = 101;
  int side_ = 0;
  Eigen::VectorXf patch_;  ///< its mean taken off
  float length_ = 0.0F;    ///< of patch_
  Eigen::Matrix<float, Eigen::Dynamic, 6> jacobian_;
  Matrix6 inverse_ = Matrix6::Zero();                  ///< of J' J
  Eigen::Matrix<float, Eigen::Dynamic, 2> influence_;  ///< k
  Eigen::Matrix2f shape_ =
      Eigen::Matrix2f::Zero();  ///< from units of half the side to px of the image
  Eigen::VectorXf seen_;        ///< in the last image
  float gain_ = 0.0F;           ///< a
  float mean_ = 0.0F;           ///< of seen_
};

}  // namespace alidade
