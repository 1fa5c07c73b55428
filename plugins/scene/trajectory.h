// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "alidade/base/random.h"
#include "alidade/config/config.h"
#include "curves.h"
#include "orientation.h"

/// Trajectory of a camera, read from the config's `source.trajectory`.
namespace alidade::scene {

/// State of a camera at one frame: the blocks of quaternion_pose.
struct CameraState {
  Vector position{};
  Quaternion orientation{1.0, 0.0, 0.0, 0.0};  ///< world_from_cam
  Vector velocity{};                           ///< m/s, world
  Vector angular_velocity{};                   ///< rad/s, cam
};

/// Reads the map `trajectory` of the config, see kSceneKeys. Returns `count` states that are dt_s
/// apart. Errors: kBadConfig.
std::vector<CameraState> ReadTrajectory(const Node& node, std::size_t count, double dt_s,
                                        Random& random);

}  // namespace alidade::scene
