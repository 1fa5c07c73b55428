// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/source_plugin.h"
#include "image_target.h"

// The source stereo_target in stereo_target.cc loads this plugin, and contains the help texts.
ALIDADE_SOURCE_PLUGIN({"image_target", "", "", &alidade::CreateImageTarget})
