// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <optional>

#include "alidade/state/eigen_alignment.h"

/// Alignment by the similarity s R p + t that minimises the sum of |q - s R p - t|^2. The points p
/// are the columns of `source`, and the points q are the columns of `target` [Umeyama1991].
namespace alidade {

/// Similarity transform: x_in_reference = scale rotation x_in_estimate + translation.
struct Similarity {
  double scale = 1.0;
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();
};

namespace internal {

/// Computes the similarity. If `has_scale` is false, the scale is 1.
Similarity Umeyama(const Eigen::Matrix3Xd& source, const Eigen::Matrix3Xd& target, bool has_scale);

/// Computes the mean of |p - mean p|^2. The result is exactly 0 if all points are equal.
double SquaredExtent(const Eigen::Matrix3Xd& points);

/// Computes the similarity. Returns nullopt for fewer than three points, or if the points do not
/// determine s > 0.
std::optional<Similarity> FindSimilarity(const Eigen::Matrix3Xd& source,
                                         const Eigen::Matrix3Xd& target);

/// Residual RMSE and scale of the best similarity.
struct SimilarityFit {
  double rmse = 0.0, scale = 1.0;
};

/// Aligns the columns of `source` to those of `target`. Returns nullopt if FindSimilarity returns
/// nullopt.
std::optional<SimilarityFit> AlignBySimilarity(const Eigen::Matrix3Xd& source,
                                               const Eigen::Matrix3Xd& target);

/// Alignment of a trajectory with a target trajectory by the best similarity [Umeyama1991]. The
/// class stores only sums, so its memory does not grow. For n pairs of points p, q with means p0,
/// q0:
///
///   C = sum (q - q0) (p - p0)' / n,    t = max tr(R' C) over rotations R
///   scale = t / var p,    rmse^2 = var q - t^2 / var p
///
/// The rmse is accurate to only 1e-8 times the extent of the trajectory, because its square is a
/// difference of similar numbers.
class TrajectoryAlignment {
 public:
  /// Adds a pair of points.
  void Add(const Eigen::Vector3d& point, const Eigen::Vector3d& target) {
    if (count_ == 0) {
      origin_ = point;
      target_origin_ = target;
    }
    const Eigen::Vector3d p = point - origin_, q = target - target_origin_;
    ++count_;
    sum_ += p;
    target_sum_ += q;
    products_ += q * p.transpose();
    squares_ += p.squaredNorm();
    target_squares_ += q.squaredNorm();
  }
  /// Returns the alignment, or nullopt if FindSimilarity would return nullopt.
  std::optional<SimilarityFit> Result() const;

 private:
  std::int64_t count_ = 0;
  Eigen::Vector3d origin_, target_origin_;
  Eigen::Vector3d sum_ = Eigen::Vector3d::Zero(), target_sum_ = Eigen::Vector3d::Zero();
  Eigen::Matrix3d products_ = Eigen::Matrix3d::Zero();
  double squares_ = 0.0, target_squares_ = 0.0;
};

}  // namespace internal
}  // namespace alidade
