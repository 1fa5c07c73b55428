// SPDX-License-Identifier: Apache-2.0
#include "plugins/common/source_on_demand.h"
#include "tracks.h"

namespace alidade {
namespace {

constexpr const char* kImageTracksKeys =
    "path           a folder of images, in the order of their names, a video, or a camera\n"
    "images         which files of the folder: 'left_*.png'; default: all that end like an image\n"
    "known          a table u,v,depth_m of points in the first image: they give the scale\n"
    "guide          a filter of `estimators`: features are looked for where it expects them\n"
    "state_entry    the state entry whose blocks the truth is named after; default cam";

std::unique_ptr<Source> CreateImageTracks(const SourceArguments& arguments) {
  return CreateOnDemand("image_tracks", arguments);
}

}  // namespace
}  // namespace alidade

ALIDADE_SOURCE_PLUGIN({"tracks", "features followed through images, from rows of a file or a pipe",
                       alidade::kTracksKeys, &alidade::CreateTracks},
                      {"image_tracks", "features found in images and followed through them",
                       alidade::kImageTracksKeys, &alidade::CreateImageTracks})
