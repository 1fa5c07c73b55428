// SPDX-License-Identifier: Apache-2.0
#include "tracks.h"

#include "alidade/host/cpp_plugin.h"

ALIDADE_SOURCE_PLUGIN({"tracks", "features followed through images, from rows of a file or a pipe",
                       alidade::kTracksKeys, &alidade::CreateTracks})
