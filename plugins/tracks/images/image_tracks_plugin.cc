// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/source_plugin.h"
#include "image_tracks.h"

// Opened by the source of that name in tracks_plugin.cc, which has the texts.
ALIDADE_SOURCE_PLUGIN({"image_tracks", "", "", &alidade::CreateImageTracks})
