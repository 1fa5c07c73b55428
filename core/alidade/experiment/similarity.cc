// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/similarity.h"

#include <Eigen/Geometry>
#include <algorithm>

#include "alidade/state/dense_algebra.h"

namespace alidade::internal {
namespace {

/// Returns whether points p and q with these variances determine s > 0. Their correlation is s
/// sqrt(var p / var q). A correlation of 1e-9 may be due to rounding errors. Points on a line
/// determine s and the residual, but not the rotation about the line.
bool DeterminesScale(double scale, double variance, double target_variance) {
  constexpr double kMinCorrelation = 1e-9;
  return variance > 0.0 && target_variance > 0.0 &&
         scale * std::sqrt(variance / target_variance) > kMinCorrelation;
}

/// Computes the symmetric matrix N that satisfies q' N q = tr(R' C) for the unit quaternion q = (w,
/// x, y, z) of any rotation R. The largest eigenvalue of N is the maximum of tr(R' C). This maximum
/// is the sum of the singular values of C, in which the smallest one has the sign of det C. The
/// eigenvector of the largest eigenvalue is the quaternion of the R that attains the maximum
/// [Horn1987].
Eigen::Matrix4d HornMatrix(const Eigen::Matrix3d& c) {
  Eigen::Matrix4d n;
  n(0, 0) = c(0, 0) + c(1, 1) + c(2, 2);
  n(1, 0) = c(2, 1) - c(1, 2);
  n(2, 0) = c(0, 2) - c(2, 0);
  n(3, 0) = c(1, 0) - c(0, 1);
  n(1, 1) = c(0, 0) - c(1, 1) - c(2, 2);
  n(2, 1) = c(0, 1) + c(1, 0);
  n(3, 1) = c(0, 2) + c(2, 0);
  n(2, 2) = c(1, 1) - c(0, 0) - c(2, 2);
  n(3, 2) = c(1, 2) + c(2, 1);
  n(3, 3) = c(2, 2) - c(0, 0) - c(1, 1);
  return n.selfadjointView<Eigen::Lower>();
}

}  // namespace

Similarity Umeyama(const Eigen::Matrix3Xd& source, const Eigen::Matrix3Xd& target, bool has_scale) {
  const Eigen::Vector3d mean = source.rowwise().mean(), target_mean = target.rowwise().mean();
  Eigen::Matrix3d c = Eigen::Matrix3d::Zero();
  double squares = 0.0;
  for (Eigen::Index i = 0; i < source.cols(); ++i) {
    const Eigen::Vector3d p = source.col(i) - mean;
    c += (target.col(i) - target_mean) * p.transpose();
    squares += p.squaredNorm();
  }
  const SymmetricEigen horn = EigenOf(HornMatrix(c));
  const Eigen::Vector4d q = horn.vectors.col(3);
  Similarity similarity;
  if (has_scale) similarity.scale = horn.values[3] / squares;
  similarity.rotation = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).toRotationMatrix();
  similarity.translation = target_mean - similarity.scale * similarity.rotation * mean;
  return similarity;
}

double SquaredExtent(const Eigen::Matrix3Xd& points) {
  const Eigen::Matrix3Xd offsets = points.colwise() - points.col(0);
  return (offsets.colwise() - offsets.rowwise().mean()).squaredNorm() /
         static_cast<double>(points.cols());
}

std::optional<Similarity> FindSimilarity(const Eigen::Matrix3Xd& source,
                                         const Eigen::Matrix3Xd& target) {
  if (source.cols() < 3) return std::nullopt;
  const double variance = SquaredExtent(source), target_variance = SquaredExtent(target);
  if (!(variance > 0.0)) return std::nullopt;
  const Similarity found = Umeyama(source, target, true);
  if (!DeterminesScale(found.scale, variance, target_variance)) return std::nullopt;
  return found;
}

std::optional<SimilarityFit> AlignBySimilarity(const Eigen::Matrix3Xd& source,
                                               const Eigen::Matrix3Xd& target) {
  const std::optional<Similarity> found = FindSimilarity(source, target);
  if (!found) return std::nullopt;
  const Eigen::Matrix3Xd residuals =
      ((found->scale * found->rotation * source).colwise() + found->translation) - target;
  return SimilarityFit{std::sqrt(residuals.squaredNorm() / static_cast<double>(residuals.cols())),
                       found->scale};
}

std::optional<SimilarityFit> TrajectoryAlignment::Result() const {
  const auto n = static_cast<double>(count_);
  const Eigen::Vector3d mean = sum_ / n, target_mean = target_sum_ / n;
  const double variance = squares_ / n - mean.squaredNorm();
  const double target_variance = target_squares_ / n - target_mean.squaredNorm();
  if (count_ < 3 || !(variance > 0.0)) return std::nullopt;
  const Eigen::Matrix3d c = products_ / n - target_mean * mean.transpose();
  const double trace = EigenvaluesOf(HornMatrix(c))[3];
  if (!DeterminesScale(trace / variance, variance, target_variance)) return std::nullopt;
  const double square = target_variance - trace * trace / variance;
  return SimilarityFit{std::sqrt(std::max(0.0, square)), trace / variance};
}

}  // namespace alidade::internal
