// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <array>

#include "alidade/config/config.h"
#include "curves.h"

/// Readers of the orientation of a camera in all forms that the config accepts.
namespace alidade::scene {

using Vector = std::array<double, 3>;

Vector ToArray(const Eigen::Vector3d& v);
Quaternion ToArray(const Eigen::Quaterniond& q);

/// Reads a quaternion `{w: , x: , y: , z: }`, which must have unit length to 1e-3.
Quaternion ReadQuaternion(const Node& node);

/// Reads the orientation of a keyframe, which has one of four forms:
///
///   rpy_deg: [roll, pitch, yaw]   R = Rz(yaw) Ry(pitch) Rx(roll)
///   matrix: [[,,], [,,], [,,]]    R, orthonormal to 1e-3, det 1; replaced by the nearest rotation
///   axis_angle_deg: [x, y, z, a]  rotation by a about the axis (x, y, z), which is not 0
///   quaternion: {w, x, y, z}      Hamilton, unit
Quaternion ReadOrientation(const Node& node);

/// Computes the orientation world_from_cam of a camera at `position` that looks at `target`. z
/// points forward; y points down, as far as z permits.
///
///   z = (target - position) / |target - position|
///   x = z x up_direction / |z x up_direction|
///   y = z x x
///
/// Returns false if z is not defined, or is parallel to up_direction. The axis x is then not
/// defined.
bool LookAt(const Eigen::Vector3d& position, const Eigen::Vector3d& target,
            const Eigen::Vector3d& up_direction, Quaternion& orientation);

/// Solves V(phi) x = y for x, with
///
///   V(phi) = I + (1 - cos)/|phi|^2 [phi]x + (|phi| - sin)/|phi|^3 [phi]x^2
///
/// y is the displacement of a body, in its initial axes, while the body rotates by phi, |phi| < 2
/// pi. If the velocity is constant in the axes of the body, x is velocity times duration.
Eigen::Vector3d BodyFrameDisplacement(const Eigen::Vector3d& phi, const Eigen::Vector3d& y);

}  // namespace alidade::scene
