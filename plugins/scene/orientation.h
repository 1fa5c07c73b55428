// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <array>

#include "alidade/config/config.h"
#include "curves.h"

/// Orientation of a camera, in the forms that the config accepts.
namespace alidade::scene {

using Vector = std::array<double, 3>;

Vector ToArray(const Eigen::Vector3d& v);
Quaternion ToArray(const Eigen::Quaterniond& q);

/// Reads `{w: , x: , y: , z: }`, of unit length to 1e-3.
Quaternion ReadQuaternion(const Node& node);

/// Reads the orientation of a key frame, in one of four forms:
///
///   euler_deg: [x, y, z]          R = Rz(z) Ry(y) Rx(x)
///   matrix: [[,,], [,,], [,,]]    R, orthonormal to 1e-3, det 1; replaced by the nearest rotation
///   axis_angle_deg: [x, y, z, a]  rotation by a about (x, y, z), of any length above 0
///   quaternion: {w, x, y, z}      Hamilton, unit
Quaternion ReadOrientation(const Node& node);

/// Computes world_from_cam of a camera at `position` that looks at `target`: z forward, y as far
/// down as z permits.
///
///   z = (target - position) / |target - position|
///   x = z x up_direction / |z x up_direction|
///   y = z x x
///
/// Returns false if this x does not exist.
bool LookAt(const Eigen::Vector3d& position, const Eigen::Vector3d& target,
            const Eigen::Vector3d& up_direction, Quaternion& orientation);

/// Solves V(phi) x = y for x, with
///
///   V(phi) = I + (1 - cos)/|phi|^2 [phi]x + (|phi| - sin)/|phi|^3 [phi]x^2
///
/// y is the displacement, in the initial axes, of a body that meanwhile rotates by phi,
/// |phi| < 2 pi. x is its displacement at constant velocity in the axes of the body.
Eigen::Vector3d BodyFrameDisplacement(const Eigen::Vector3d& phi, const Eigen::Vector3d& y);

}  // namespace alidade::scene
