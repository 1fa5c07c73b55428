// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/source_plugin.h"
#include "image_target.h"

// Opened by the source stereo_target in stereo_target.cc, which has the texts.
ALIDADE_SOURCE_PLUGIN({"image_target", "", "", &alidade::CreateImageTarget})
