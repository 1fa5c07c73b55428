// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/source_plugin.h"
#include "depth_target.h"

ALIDADE_SOURCE_PLUGIN(
    {"depth_target",
     "simulator: a stereo pair and a 2D tracker measure a target that oscillates in depth", "",
     &alidade::CreateDepthTarget})
