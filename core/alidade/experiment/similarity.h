// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <optional>

#include "alidade/state/eigen_alignment.h"

/// The similarity that brings points p, columns of `from`, nearest to q, those of `to`: s R p + t
/// with sum |q - s R p - t|^2 least [Umeyama1991].
namespace alidade {

/// x_in_reference = scale rotation x_in_estimate + translation
struct Similarity {
  double scale = 1.0;
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();
};

namespace internal {

/// With a scale, or with scale 1.
Similarity Umeyama(const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to, bool with_scale);

/// Mean of |p - mean p|^2; exactly 0 where all points are one.
double SquaredExtent(const Eigen::Matrix3Xd& points);

/// Nothing of fewer than three points, and where the points do not determine s > 0.
std::optional<Similarity> FindSimilarity(const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to);

/// What the similarity that brings points nearest to others leaves, and its scale.
struct Aligned {
  double rmse = 0.0, scale = 1.0;
};

/// Of the columns; nothing where FindSimilarity finds none.
std::optional<Aligned> AlignBySimilarity(const Eigen::Matrix3Xd& points,
                                         const Eigen::Matrix3Xd& onto);

/// The similarity that brings a trajectory nearest to another [Umeyama1991], from sums alone, so
/// that a long trajectory takes no memory. Points p, q of both, n of them, with means p0, q0:
///
///   C = sum (q - q0) (p - p0)' / n,    t = max tr(R' C) over rotations R
///   scale = t / var p,    rmse^2 = var q - t^2 / var p
///
/// rmse is good to 1e-8 of the extent of the trajectory, as its square is a difference.
class TrajectoryAlignment {
 public:
  void Add(const Eigen::Vector3d& point, const Eigen::Vector3d& onto) {
    if (count_ == 0) {
      origin_ = point;
      onto_origin_ = onto;
    }
    const Eigen::Vector3d p = point - origin_, q = onto - onto_origin_;
    ++count_;
    sum_ += p;
    onto_sum_ += q;
    products_ += q * p.transpose();
    squares_ += p.squaredNorm();
    onto_squares_ += q.squaredNorm();
  }
  /// Nothing where FindSimilarity finds none.
  std::optional<Aligned> Result() const;

 private:
  std::int64_t count_ = 0;
  Eigen::Vector3d origin_, onto_origin_;
  Eigen::Vector3d sum_ = Eigen::Vector3d::Zero(), onto_sum_ = Eigen::Vector3d::Zero();
  Eigen::Matrix3d products_ = Eigen::Matrix3d::Zero();
  double squares_ = 0.0, onto_squares_ = 0.0;
};

}  // namespace internal
}  // namespace alidade
