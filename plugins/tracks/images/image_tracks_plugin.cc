// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/source_plugin.h"
#include "image_tracks.h"

// The source `image_tracks` in tracks_plugin.cc loads this plugin, and contains the help texts.
ALIDADE_SOURCE_PLUGIN({"image_tracks", "", "", &alidade::CreateImageTracks})
