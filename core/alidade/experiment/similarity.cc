// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/similarity.h"

#include <Eigen/Geometry>
#include <algorithm>

#include "alidade/state/dense_algebra.h"

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

/// The symmetric N with q' N q = tr(R' C) for every unit quaternion q = (w, x, y, z) of R. Its
/// largest eigenvalue is the greatest tr(R' C), the sum of the singular values of C, the last with
/// the sign of det C; its vector is that R [Horn1987].
Eigen::Matrix4d TurnsOf(const Eigen::Matrix3d& c) {
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

Similarity Umeyama(const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to, bool with_scale) {
  const Eigen::Vector3d mean = from.rowwise().mean(), to_mean = to.rowwise().mean();
  Eigen::Matrix3d c = Eigen::Matrix3d::Zero();
  double squares = 0.0;
  for (Eigen::Index i = 0; i < from.cols(); ++i) {
    const Eigen::Vector3d p = from.col(i) - mean;
    c += (to.col(i) - to_mean) * p.transpose();
    squares += p.squaredNorm();
  }
  const SymmetricEigen turns = EigenOf(TurnsOf(c));
  const Eigen::Vector4d q = turns.vectors.col(3);
  Similarity found;
  if (with_scale) found.scale = turns.values[3] / squares;
  found.rotation = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).toRotationMatrix();
  found.translation = to_mean - found.scale * found.rotation * mean;
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
  const double trace = EigenvaluesOf(TurnsOf(c))[3];
  if (!DeterminesScale(trace / variance, variance, onto_variance)) return std::nullopt;
  const double square = onto_variance - trace * trace / variance;
  return Aligned{std::sqrt(std::max(0.0, square)), trace / variance};
}

}  // namespace alidade::internal
