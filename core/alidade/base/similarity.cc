// SPDX-License-Identifier: Apache-2.0
#include "alidade/base/similarity.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>

namespace alidade::internal {
namespace {

/// Whether p and q of these variances determine s > 0. s sqrt(var p / var q) is their correlation;
/// one of 1e-9 is rounding. Points on a line determine s, and what is left, but not the turn about
/// the line.
bool DeterminesScale(double scale, double variance, double to_variance) {
  constexpr double kLeastCorrelation = 1e-9;
  return variance > 0.0 && to_variance > 0.0 &&
         scale * std::sqrt(variance / to_variance) > kLeastCorrelation;
}

}  // namespace

Similarity Umeyama(const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to, bool with_scale) {
  const Eigen::Matrix4d matrix = Eigen::umeyama(from, to, with_scale);
  Similarity found;
  const Eigen::Matrix3d linear = matrix.topLeftCorner<3, 3>();
  if (with_scale) found.scale = std::cbrt(linear.determinant());
  found.rotation = linear / found.scale;
  found.translation = matrix.topRightCorner<3, 1>();
  return found;
}

double SquaredExtent(const Eigen::Matrix3Xd& points) {
  const Eigen::Matrix3Xd from_first = points.colwise() - points.col(0);
  return (from_first.colwise() - from_first.rowwise().mean()).squaredNorm() /
         static_cast<double>(points.cols());
}

std::optional<Similarity> FindSimilarity(const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to) {
  if (from.cols() < 3) return std::nullopt;
  const double variance = SquaredExtent(from), to_variance = SquaredExtent(to);
  if (!(variance > 0.0)) return std::nullopt;
  const Similarity found = Umeyama(from, to, true);
  if (!DeterminesScale(found.scale, variance, to_variance)) return std::nullopt;
  return found;
}

std::optional<Aligned> AlignBySimilarity(const Eigen::Matrix3Xd& points,
                                         const Eigen::Matrix3Xd& onto) {
  const std::optional<Similarity> found = FindSimilarity(points, onto);
  if (!found) return std::nullopt;
  const Eigen::Matrix3Xd left =
      ((found->scale * found->rotation * points).colwise() + found->translation) - onto;
  return Aligned{std::sqrt(left.squaredNorm() / static_cast<double>(left.cols())), found->scale};
}

std::optional<Aligned> TrajectoryAlignment::Result() const {
  const auto n = static_cast<double>(count_);
  const Eigen::Vector3d mean = sum_ / n, onto_mean = onto_sum_ / n;
  const double variance = squares_ / n - mean.squaredNorm();
  const double onto_variance = onto_squares_ / n - onto_mean.squaredNorm();
  if (count_ < 3 || !(variance > 0.0)) return std::nullopt;
  const Eigen::Matrix3d c = products_ / n - onto_mean * mean.transpose();
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(c, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::VectorXd d = svd.singularValues();
  if (svd.matrixU().determinant() * svd.matrixV().determinant() < 0.0) d[2] = -d[2];
  const double trace = d.sum();
  if (!DeterminesScale(trace / variance, variance, onto_variance)) return std::nullopt;
  const double square = onto_variance - trace * trace / variance;
  return Aligned{std::sqrt(std::max(0.0, square)), trace / variance};
}

}  // namespace alidade::internal
