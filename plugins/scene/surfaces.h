// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "alidade/config/config.h"
#include "plugins/common/surfaces.h"

/// Textured surfaces of a scene, read from the config's `source.surfaces`.
namespace alidade::scene {

/// Reads the list `surfaces` of the config, see kSceneKeys. Errors: kBadConfig.
std::vector<Rectangle> ReadSurfaces(const Node& list);

}  // namespace alidade::scene
