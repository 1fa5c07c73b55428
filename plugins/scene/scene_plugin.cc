// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/source_plugin.h"
#include "scene.h"

ALIDADE_SOURCE_PLUGIN({"scene", "simulator: a moving camera observes points in space",
                       alidade::kSceneKeys, &alidade::CreateScene})
