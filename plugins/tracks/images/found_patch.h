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

/// Patch about a feature at its first detection. In each image the feature is aligned with this
/// patch. Errors therefore do not accumulate from image to image. The inverse compositional
/// algorithm [Baker2004] computes everything that does not depend on the image only once:
///
///   e(x) = a sampled(A x + t) + b - patch(x),   d = (J' J)^-1 J' e,   (A, t) <- (A, t) (I + D)^-1
///
/// x is relative to the middle of the patch, in units of half its side. J is the derivative of the
/// patch with respect to the six numbers of D, without the part that a change of light explains. a
/// and b convert `sampled` to the mean and the variance of the patch. J is orthogonal to 1 and to
/// the patch. Therefore J' e = a J' sampled.
class FoundPatch {
 public:
  FoundPatch() = default;
  /// `side` is odd and at most 101. The patch must be inside the image.
  FoundPatch(const cv::Mat& image, cv::Point2f middle, int side) : side_(side) {
    cv::Mat surroundings;
    cv::getRectSubPix(image, cv::Size(side + 2, side + 2), middle, surroundings, CV_32F);
    const int n = side * side;
    const float half = 0.5F * static_cast<float>(side - 1);
    patch_.resize(n);
    jacobian_.resize(n, 6);
    for (int y = 0; y < side; ++y) {
      const float* const row = surroundings.ptr<float>(y + 1) + 1;
      const float* const above = surroundings.ptr<float>(y) + 1;
      const float* const below = surroundings.ptr<float>(y + 2) + 1;
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
    // Limits the changes that the texture does not determine, such as the rotation of a disc.
    constexpr float kWeak = 1e-3F;
    const Matrix6 damped = normal + kWeak * normal.trace() / 6.0F * Matrix6::Identity();
    inverse_ = damped.ldlt().solve(Matrix6::Identity());
    influence_.resize(n, 2);
    influence_.col(0) = jacobian_ * inverse_.col(2);
    influence_.col(1) = jacobian_ * inverse_.col(5);
    shape_ << half, 0.0F, 0.0F, half;
  }

  /// Moves `position`, px, to the position of the patch in `image`, 8 bit grey, and stores the
  /// shape of the patch in this image. If the alignment does not converge, leaves the image, or has
  /// a correlation below `least_similarity`, returns false and changes nothing.
  bool Align(const cv::Mat& image, float least_similarity, cv::Point2f& position) {
    constexpr int kMaxIterations = 15;
    constexpr float kSettled = 4e-3F;  // px; each step is at most a tenth of the previous one
    Eigen::Matrix2f shape = shape_;
    Eigen::Vector2f centre(position.x, position.y);
    for (int k = 0; k < kMaxIterations; ++k) {
      if (!Sample(image, shape, centre)) return false;
      const Vector6 d = gain_ * (inverse_ * (jacobian_.transpose() * sampled_));
      Eigen::Matrix3f change;
      change << 1.0F + d[0], d[1], d[2], d[3], 1.0F + d[4], d[5], 0.0F, 0.0F, 1.0F;
      const Eigen::Matrix3f inverse = change.inverse();
      centre += shape * inverse.topRightCorner<2, 1>();
      shape = shape * inverse.topLeftCorner<2, 2>();
      const float largest = d.cwiseAbs().maxCoeff();
      if (!(largest < 0.5F)) return false;
      if (largest * 0.5F * static_cast<float>(side_ - 1) < kSettled) {
        if (Similarity() < least_similarity) return false;
        shape_ = shape;
        position = {centre[0], centre[1]};
        return true;
      }
    }
    return false;
  }

  /// Returns the correlation of the patch with the image after the last alignment, in [-1, 1].
  float Similarity() const { return gain_ * sampled_.dot(patch_) / (length_ * length_); }

  /// Returns the covariance of the position after the last alignment, px^2. It follows from the
  /// residuals e, which move the position by t = sum k e. Nearby residuals are correlated.
  /// Therefore
  ///
  ///   C = A (sum over cells of (sum k e) (sum k e)') A',   k = [(J' J)^-1 J']_t
  ///
  /// The side of a cell is a fifth of the side of the patch. C is consistent for any correlation of
  /// e within a cell [Liang1986]. A patch across a depth edge, whose parts move separately, has a
  /// large covariance. The covariance is zero before the first alignment.
  Eigen::Matrix2f Covariance() const {
    constexpr int kCells = 5;
    Eigen::Matrix2f sum = Eigen::Matrix2f::Zero();
    if (sampled_.size() == 0) return sum;
    const auto edge = [&](int cell) { return cell * side_ / kCells; };
    for (int row = 0; row < kCells; ++row) {
      Eigen::Matrix<float, 2, kCells> shifts = Eigen::Matrix<float, 2, kCells>::Zero();
      for (int y = edge(row); y < edge(row + 1); ++y) {
        for (int column = 0; column < kCells; ++column) {
          for (int i = y * side_ + edge(column); i < y * side_ + edge(column + 1); ++i) {
            const float e = gain_ * (sampled_[i] - mean_) - patch_[i];
            shifts(0, column) += influence_(i, 0) * e;
            shifts(1, column) += influence_(i, 1) * e;
          }
        }
      }
      sum += shifts * shifts.transpose();
    }
    return shape_ * sum * shape_.transpose();
  }

 private:
  using Matrix6 = Eigen::Matrix<float, 6, 6>;
  using Vector6 = Eigen::Matrix<float, 6, 1>;

  /// Samples the image about `centre` into `sampled_`. Sets `gain_`, which scales `sampled_` to the
  /// variance of the patch. Returns false if a part of the patch is outside the image.
  bool Sample(const cv::Mat& image, const Eigen::Matrix2f& shape, const Eigen::Vector2f& centre) {
    // The margin of 0.01 px allows for rounding, which can move the rim slightly outwards.
    const Eigen::Vector2f reach = shape.cwiseAbs().rowwise().sum().array() + 0.01F;
    if (!(centre[0] - reach[0] >= 0.0F && centre[1] - reach[1] >= 0.0F &&
          centre[0] + reach[0] < static_cast<float>(image.cols - 1) &&
          centre[1] + reach[1] < static_cast<float>(image.rows - 1))) {
      return false;
    }
    sampled_.resize(patch_.size());
    const Eigen::Matrix2f step = shape * (2.0F / static_cast<float>(side_ - 1));
    const Eigen::Vector2f corner = centre - shape.rowwise().sum();
    for (int y = 0; y < side_; ++y) {
      SampleRow(image, corner + static_cast<float>(y) * step.col(1), step.col(0),
                sampled_.data() + y * side_);
    }
    mean_ = sampled_.mean();
    const float length = std::sqrt((sampled_.array() - mean_).square().sum());
    if (!(length > 0.0F && length_ > 0.0F)) return false;
    gain_ = length_ / length;
    return true;
  }

  /// Samples a row by bilinear interpolation. The work is split into several loops, so that the
  /// compiler can vectorise the loops that do not access memory by index.
  void SampleRow(const cv::Mat& image, Eigen::Vector2f start, Eigen::Vector2f step,
                 float* destination) const {
    float right[kMaxSide], down[kMaxSide];
    int offset[kMaxSide];
    std::uint16_t upper[kMaxSide], lower[kMaxSide];  // two neighbouring pixels in each number
    const auto stride = static_cast<int>(image.step[0]);
    for (int x = 0; x < side_; ++x) {
      const float u = start[0] + static_cast<float>(x) * step[0];
      const float v = start[1] + static_cast<float>(x) * step[1];
      const int column = static_cast<int>(u), row = static_cast<int>(v);
      right[x] = u - static_cast<float>(column);
      down[x] = v - static_cast<float>(row);
      offset[x] = row * stride + column;
    }
    const unsigned char* const grey = image.ptr<unsigned char>();
    for (int x = 0; x < side_; ++x) {
      const unsigned char* const upper_pixels = grey + offset[x];
      const unsigned char* const lower_pixels = upper_pixels + stride;
      upper[x] = static_cast<std::uint16_t>(upper_pixels[0] | upper_pixels[1] << 8);
      lower[x] = static_cast<std::uint16_t>(lower_pixels[0] | lower_pixels[1] << 8);
    }
    for (int x = 0; x < side_; ++x) {
      const auto mix = [&](int pair) {
        const int first = pair & 255, second = pair >> 8;
        return static_cast<float>(first) + right[x] * static_cast<float>(second - first);
      };
      const float upper_value = mix(upper[x]), lower_value = mix(lower[x]);
      destination[x] = upper_value + down[x] * (lower_value - upper_value);
    }
  }

  static constexpr int kMaxSide = 101;
  int side_ = 0;
  Eigen::VectorXf patch_;  ///< grey values minus their mean
  float length_ = 0.0F;    ///< length of patch_
  Eigen::Matrix<float, Eigen::Dynamic, 6> jacobian_;
  Matrix6 inverse_ = Matrix6::Zero();                  ///< inverse of J' J
  Eigen::Matrix<float, Eigen::Dynamic, 2> influence_;  ///< k, see Covariance()
  Eigen::Matrix2f shape_ = Eigen::Matrix2f::Zero();    ///< matrix A, px per half side
  Eigen::VectorXf sampled_;                            ///< image, sampled in the last alignment
  float gain_ = 0.0F;                                  ///< a, the scale of the grey values
  float mean_ = 0.0F;                                  ///< mean of sampled_
};

}  // namespace alidade
