// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <array>

#include "alidade/config/config.h"
#include "curves.h"

/// How a camera is turned, in the forms that the config may say it.
namespace alidade::scene {

using Vector = std::array<double, 3>;

Vector ToArray(const Eigen::Vector3d& v);
Quaternion ToArray(const Eigen::Quaterniond& q);

/// `{w: , x: , y: , z: }`, of unit length to 1e-3.
Quaternion ReadQuaternion(const Node& node);

/// The orientation of a key frame, in one of four forms:
///
///   euler_deg: [x, y, z]          R = Rz(z) Ry(y) Rx(x)
///   matrix: [[,,], [,,], [,,]]    R, orthonormal to 1e-3, determinant 1; the nearest rotation
///   axis_angle_deg: [x, y, z, a]  turned by a about (x, y, z), of any length above 0
///   quaternion: {w, x, y, z}      Hamilton, unit
Quaternion ReadOrientation(const Node& node);

/// world_from_cam of a camera at `from` that looks at `at`: z ahead, y as far down as z lets it.
///
///   z = (at - from) / |at - from|,  x = z x up / |z x up|,  y = z x x
///
/// false where there is no such x.
bool LookAt(const Eigen::Vector3d& from, const Eigen::Vector3d& at, const Eigen::Vector3d& up,
            Quaternion& orientation);

/// x with V(phi) x = y, V(phi) = I + (1 - cos)/|phi|^2 [phi]x + (|phi| - sin)/|phi|^3 [phi]x^2:
/// the way y of a body that turns by phi meanwhile, in its axes at the start, as constant velocity
/// in its own. |phi| < 2 pi.
Eigen::Vector3d UndoTurn(const Eigen::Vector3d& phi, const Eigen::Vector3d& y);

}  // namespace alidade::scene
