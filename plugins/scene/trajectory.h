// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "alidade/base/random.h"
#include "alidade/config/config.h"
#include "curves.h"
#include "orientation.h"

/// Where a camera is at each frame, from the config's `source.trajectory`.
namespace alidade::scene {

/// A camera at one frame, as the blocks of quaternion_pose have it.
struct CameraState {
  Vector position{};
  Quaternion orientation{1.0, 0.0, 0.0, 0.0};  ///< world_from_cam
  Vector velocity{};                           ///< m/s, world
  Vector angular_velocity{};                   ///< rad/s, cam
};

/// The map `trajectory` of the config, see kSceneKeys: `count` states, dt_s apart. Errors:
/// kBadConfig.
std::vector<CameraState> ReadTrajectory(const Node& node, std::size_t count, double dt_s,
                                        Random& random);

}  // namespace alidade::scene
