// SPDX-License-Identifier: Apache-2.0
#include "plugins/common/source_on_demand.h"
#include "tracks.h"

namespace alidade {
namespace {

constexpr const char* kImageTracksKeys =
    "path           a folder of images, in the order of their names, a video, or a camera\n"
    "images         pattern of the image files: 'left_*.png'; default: all endings of image files\n"
    "known          table u,v,depth_m of points in the first image, which determine the scale\n"
    "guide          filter of `estimators`: features are searched for at its expected positions\n"
    "state_entry    state entry in the names of the truth; default cam";

std::unique_ptr<Source> CreateImageTracks(const SourceArguments& arguments) {
  return CreateOnDemand("image_tracks", arguments);
}

}  // namespace
}  // namespace alidade

ALIDADE_SOURCE_PLUGIN({"tracks", "features tracked through images, from rows of a file or a pipe",
                       alidade::kTracksKeys, &alidade::CreateTracks},
                      {"image_tracks", "features found in images and tracked through them",
                       alidade::kImageTracksKeys, &alidade::CreateImageTracks})
