// SPDX-License-Identifier: Apache-2.0
#include "orientation.h"

#include <Eigen/LU>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "alidade/model/geometry.h"
#include "points.h"

namespace alidade::scene {

Vector ToArray(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

Quaternion ToArray(const Eigen::Quaterniond& q) { return {q.w(), q.x(), q.y(), q.z()}; }

Quaternion ReadQuaternion(const Node& node) {
  Quaternion q;
  const char* const keys[] = {"w", "x", "y", "z"};
  double sum = 0.0;
  for (std::size_t i = 0; i < 4; ++i) {
    q[i] = node.At(keys[i], "a quaternion").Number();
    sum += q[i] * q[i];
  }
  node.RejectUnread();
  if (!(std::abs(std::sqrt(sum) - 1.0) <= 1e-3)) {
    node.Fail("the quaternion does not have unit length", "w^2 + x^2 + y^2 + z^2 = 1 to 1e-3");
  }
  UnitQuaternion::Normalise(q.data());
  return q;
}

Quaternion ReadOrientation(const Node& node) {
  const auto [kind, value] = OneOf(node, {"rpy_deg", "matrix", "axis_angle_deg", "quaternion"});
  constexpr double kRadPerDeg = std::numbers::pi / 180.0;
  using Eigen::AngleAxisd;
  using Eigen::Vector3d;
  if (kind == "quaternion") return ReadQuaternion(value);
  if (kind == "rpy_deg") {
    const Vector3d angle = kRadPerDeg * ReadVector(value);
    return ToArray(Eigen::Quaterniond(AngleAxisd(angle.z(), Vector3d::UnitZ()) *
                                      AngleAxisd(angle.y(), Vector3d::UnitY()) *
                                      AngleAxisd(angle.x(), Vector3d::UnitX())));
  }
  if (kind == "axis_angle_deg") {
    const std::vector<double> v = value.Numbers(4);
    const Vector3d axis(v[0], v[1], v[2]);
    if (!(axis.norm() > 0.0)) {
      value.Fail("the axis has length 0", "[x, y, z, angle], in which (x, y, z) is not 0");
    }
    return ToArray(Eigen::Quaterniond(AngleAxisd(kRadPerDeg * v[3], axis.normalized())));
  }
  Eigen::Matrix3d rotation;
  const std::vector<Node> rows = value.Items();
  if (rows.size() != 3) {
    value.Fail("the matrix does not have three rows", "[[a, b, c], [d, e, f], [g, h, i]]");
  }
  for (int i = 0; i < 3; ++i) {
    rotation.row(i) = ReadVector(rows[static_cast<std::size_t>(i)]).transpose();
  }
  const double skew = (rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).norm();
  if (!(skew <= 1e-3) || !(rotation.determinant() > 0.0)) {
    value.Fail("the matrix is not a rotation", "R R' = I to 1e-3, and determinant 1");
  }
  return ToArray(Eigen::Quaterniond(rotation).normalized());
}

bool LookAt(const Eigen::Vector3d& position, const Eigen::Vector3d& target,
            const Eigen::Vector3d& up_direction, Quaternion& orientation) {
  constexpr double kMinLength = 1e-9;
  const Eigen::Vector3d forward = target - position;
  if (!(forward.norm() > kMinLength)) return false;
  Eigen::Matrix3d rotation;
  rotation.col(2) = forward.normalized();
  const Eigen::Vector3d right = rotation.col(2).cross(up_direction.normalized());
  if (!(right.norm() > kMinLength)) return false;
  rotation.col(0) = right.normalized();
  rotation.col(1) = rotation.col(2).cross(rotation.col(0));
  orientation = ToArray(Eigen::Quaterniond(rotation).normalized());
  return true;
}

Eigen::Vector3d BodyFrameDisplacement(const Eigen::Vector3d& phi, const Eigen::Vector3d& y) {
  const double angle = phi.norm();
  constexpr double kSeries = 1e-4;
  const double a = angle < kSeries ? 0.5 : (1.0 - std::cos(angle)) / (angle * angle);
  const double b =
      angle < kSeries ? 1.0 / 6.0 : (angle - std::sin(angle)) / (angle * angle * angle);
  Eigen::Matrix3d cross;
  cross << 0.0, -phi.z(), phi.y(), phi.z(), 0.0, -phi.x(), -phi.y(), phi.x(), 0.0;
  const Eigen::Matrix3d v = Eigen::Matrix3d::Identity() + a * cross + b * cross * cross;
  return v.partialPivLu().solve(y);
}

}  // namespace alidade::scene
