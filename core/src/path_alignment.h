// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>

namespace alidade::internal {

/// What the similarity that brings points nearest to others leaves, and its scale.
struct Aligned {
  double rmse = 0.0, scale = 1.0;
};

/// The similarity that brings a path nearest to another [Umeyama1991], from sums alone, so that a
/// long path takes no memory. Points p, q of both, n of them, with means p0, q0:
///
///   C = sum (q - q0) (p - p0)' / n = U D V',    S = diag(1, 1, det U det V)
///   scale = tr(D S) / var p,    rmse^2 = var q - tr(D S)^2 / var p
///
/// rmse is good to 1e-8 of the path's extent, as its square is a difference.
class PathAlignment {
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
  /// Nothing where FindSimilarity finds none (similarity.h).
  std::optional<Aligned> Result() const;

 private:
  std::int64_t count_ = 0;
  Eigen::Vector3d origin_, onto_origin_;
  Eigen::Vector3d sum_ = Eigen::Vector3d::Zero(), onto_sum_ = Eigen::Vector3d::Zero();
  Eigen::Matrix3d products_ = Eigen::Matrix3d::Zero();
  double squares_ = 0.0, onto_squares_ = 0.0;
};

}  // namespace alidade::internal
