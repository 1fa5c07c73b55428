// SPDX-License-Identifier: Apache-2.0
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "alidade/base/error.h"
#include "alidade/evaluate/evaluate.h"

namespace alidade {
namespace {

using internal::SquaredExtent;
using internal::Umeyama;

[[noreturn]] void Fail(const std::string& name, const std::string& problem,
                       const std::string& expected) {
  throw Error(ExitCode::kBadData, ErrorLine({name}, {}, problem, expected));
}

/// Finds the rotation R about z that maximises the sum of p_ref' R p_est over the points, after
/// their means are subtracted [Zhang2018]. Returns the rotation and the translation.
Similarity AlignYaw(const Eigen::Matrix3Xd& estimate_points,
                    const Eigen::Matrix3Xd& reference_points) {
  const Eigen::Vector3d estimate_mean = estimate_points.rowwise().mean(),
                        reference_mean = reference_points.rowwise().mean();
  const Eigen::Matrix3d c = (reference_points.colwise() - reference_mean) *
                            (estimate_points.colwise() - estimate_mean).transpose();
  const double yaw = std::atan2(c(1, 0) - c(0, 1), c(0, 0) + c(1, 1));
  Similarity transformation;
  transformation.rotation = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  transformation.translation = reference_mean - transformation.rotation * estimate_mean;
  return transformation;
}

Similarity AlignOrigin(const Trajectory& reference, const Trajectory& estimate) {
  Similarity transformation;
  transformation.rotation =
      (reference.orientations[0] * estimate.orientations[0].conjugate()).toRotationMatrix();
  transformation.translation =
      reference.positions.col(0) - transformation.rotation * estimate.positions.col(0);
  return transformation;
}

}  // namespace

const char* ToString(Alignment alignment) {
  constexpr const char* kNames[] = {"none", "scale", "origin", "yaw", "se3", "sim3"};
  return kNames[static_cast<std::size_t>(alignment)];
}

Trajectory operator*(const Similarity& reference_from_estimate, const Trajectory& estimate) {
  const auto& [scale, rotation, translation] = reference_from_estimate;
  Trajectory aligned = estimate;
  aligned.positions = ((scale * rotation) * estimate.positions).colwise() + translation;
  const Eigen::Quaterniond rotation_q(rotation);
  for (Eigen::Quaterniond& q : aligned.orientations) q = (rotation_q * q).normalized();
  aligned.position_covariances.clear();
  aligned.orientation_covariances.clear();
  return aligned;
}

Similarity Align(Alignment alignment, const Trajectory& reference, const Trajectory& estimate,
                 int poses) {
  ALIDADE_EXPECTS(reference.size() == estimate.size() && estimate.size() > 0 && poses >= 0);
  if (alignment == Alignment::kNone) return {};
  if (alignment == Alignment::kOrigin) return AlignOrigin(reference, estimate);
  const int used = poses == 0 ? estimate.size() : std::min(poses, estimate.size());
  const Eigen::Matrix3Xd estimate_points = estimate.positions.leftCols(used);
  const Eigen::Matrix3Xd reference_points = reference.positions.leftCols(used);
  if (used < 3) {
    Fail(estimate.name, std::to_string(used) + " poses are too few for an alignment",
         "3 or more poses");
  }
  if (alignment == Alignment::kYaw) return AlignYaw(estimate_points, reference_points);
  if (alignment == Alignment::kSe3) return Umeyama(estimate_points, reference_points, false);
  const std::optional<Similarity> similarity =
      internal::FindSimilarity(estimate_points, reference_points);
  if (!similarity) {
    const auto at_one_point = [](const auto& points) { return !(SquaredExtent(points) > 0.0); };
    if (at_one_point(estimate_points) || at_one_point(reference_points)) {
      Fail((at_one_point(estimate_points) ? estimate : reference).name,
           "all poses are at one point", "a trajectory that determines a scale");
    }
    Fail(estimate.name,
         "the scale is undetermined: the positions are not correlated with those of " +
             reference.name,
         "poses of the same trajectory, or --align, which does not estimate the scale");
  }
  Similarity transformation = *similarity;
  if (alignment == Alignment::kScale) {
    transformation.rotation.setIdentity();
    transformation.translation.setZero();
  }
  return transformation;
}

}  // namespace alidade
