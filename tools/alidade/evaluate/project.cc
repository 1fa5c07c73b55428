// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "alidade/evaluate/evaluate.h"

namespace alidade {
namespace {

/// Returns the angle about the axis in R = Rz(c) Ry(b) Rx(a): a, b or c.
double EulerAngle(const Eigen::Matrix3d& r, int axis) {
  if (axis == 0) return std::atan2(r(2, 1), r(2, 2));
  if (axis == 1) return std::atan2(-r(2, 0), std::hypot(r(0, 0), r(1, 0)));
  return std::atan2(r(1, 0), r(0, 0));
}

}  // namespace

const char* ToString(Plane plane) {
  constexpr const char* kNames[] = {"none", "xy", "xz", "yz"};
  return kNames[static_cast<std::size_t>(plane)];
}

Trajectory Project(const Trajectory& trajectory, Plane plane) {
  if (plane == Plane::kNone) return trajectory;
  const int normal = plane == Plane::kXy ? 2 : plane == Plane::kXz ? 1 : 0;
  const Eigen::Vector3d axis = Eigen::Vector3d::Unit(normal);
  Trajectory projected = trajectory;
  projected.positions.row(normal).setZero();
  for (Eigen::Quaterniond& q : projected.orientations) {
    q = Eigen::AngleAxisd(EulerAngle(q.toRotationMatrix(), normal), axis);
  }
  projected.position_covariances.clear();
  projected.orientation_covariances.clear();
  return projected;
}

}  // namespace alidade
