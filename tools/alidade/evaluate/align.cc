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

[[noreturn]] void Fail(const std::string& name, const std::string& what,
                       const std::string& expected) {
  throw Error(ExitCode::kBadData, ErrorLine({name}, {}, what, expected));
}

/// The rotation about z that maximises sum to' R from of centred points [Zhang2018].
Similarity YawOnly(const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to) {
  const Eigen::Vector3d from_mean = from.rowwise().mean(), to_mean = to.rowwise().mean();
  const Eigen::Matrix3d c = (to.colwise() - to_mean) * (from.colwise() - from_mean).transpose();
  const double yaw = std::atan2(c(1, 0) - c(0, 1), c(0, 0) + c(1, 1));
  Similarity found;
  found.rotation = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  found.translation = to_mean - found.rotation * from_mean;
  return found;
}

Similarity Origin(const Trajectory& reference, const Trajectory& estimate) {
  Similarity found;
  found.rotation =
      (reference.orientations[0] * estimate.orientations[0].conjugate()).toRotationMatrix();
  found.translation = reference.positions.col(0) - found.rotation * estimate.positions.col(0);
  return found;
}

}  // namespace

const char* ToString(Alignment alignment) {
  constexpr const char* kNames[] = {"none", "scale", "origin", "yaw", "se3", "sim3"};
  return kNames[static_cast<std::size_t>(alignment)];
}

Trajectory operator*(const Similarity& reference_from_estimate, const Trajectory& estimate) {
  const auto& [scale, rotation, translation] = reference_from_estimate;
  Trajectory moved = estimate;
  moved.positions = ((scale * rotation) * estimate.positions).colwise() + translation;
  const Eigen::Quaterniond turn(rotation);
  for (Eigen::Quaterniond& q : moved.orientations) q = (turn * q).normalized();
  moved.position_covariances.clear();
  moved.orientation_covariances.clear();
  return moved;
}

Similarity Align(Alignment alignment, const Trajectory& reference, const Trajectory& estimate,
                 int poses) {
  ALIDADE_EXPECTS(reference.size() == estimate.size() && estimate.size() > 0 && poses >= 0);
  if (alignment == Alignment::kNone) return {};
  if (alignment == Alignment::kOrigin) return Origin(reference, estimate);
  const int used = poses == 0 ? estimate.size() : std::min(poses, estimate.size());
  const Eigen::Matrix3Xd from = estimate.positions.leftCols(used);
  const Eigen::Matrix3Xd to = reference.positions.leftCols(used);
  if (used < 3) {
    Fail(estimate.name, std::to_string(used) + " poses to align by", "3 or more");
  }
  if (alignment == Alignment::kYaw) return YawOnly(from, to);
  if (alignment == Alignment::kSe3) return Umeyama(from, to, false);
  const std::optional<Similarity> similarity = internal::FindSimilarity(from, to);
  if (!similarity) {
    const auto at_one_place = [](const auto& points) { return !(SquaredExtent(points) > 0.0); };
    if (at_one_place(from) || at_one_place(to)) {
      Fail((at_one_place(from) ? estimate : reference).name, "all poses are at one place",
           "a trajectory, to take a scale from");
    }
    Fail(estimate.name,
         "no scale: its positions have nothing in common with those of " + reference.name,
         "poses of the same trajectory, or --align");
  }
  Similarity found = *similarity;
  if (alignment == Alignment::kScale) {
    found.rotation.setIdentity();
    found.translation.setZero();
  }
  return found;
}

}  // namespace alidade
