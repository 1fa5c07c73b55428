// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/source_plugin.h"
#include "scene.h"

ALIDADE_SOURCE_PLUGIN({"scene", "simulator: points in space, seen by a moving camera",
                       alidade::kSceneKeys, &alidade::CreateScene})
