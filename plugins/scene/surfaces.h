// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "alidade/config/config.h"
#include "plugins/common/surfaces.h"

/// The textured surfaces of a scene, from the config's `source.surfaces`.
namespace alidade::scene {

/// The list `surfaces` of the config, see kSceneKeys. Errors: kBadConfig.
std::vector<Rectangle> ReadSurfaces(const Node& list);

}  // namespace alidade::scene
