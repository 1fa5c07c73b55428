// SPDX-License-Identifier: Apache-2.0
#include "plugins/common/source_on_demand.h"
#include "tracks.h"

namespace alidade {
namespace {

constexpr const char* kImageTracksKeys =
    "path           folder of images, which are read in the order of their names; video; or "
    "camera\n"
    "images         pattern of the file names, such as 'left_*.png'; default: all image files\n"
    "known          table u,v,depth_m of points in the first image, which determine the scale\n"
    "guide          filter of `estimators` that predicts the positions of features; default none\n"
    "state_entry    state entry to which the true values belong; default cam";

std::unique_ptr<Source> CreateImageTracks(const SourceArguments& arguments) {
  return CreateOnDemand("image_tracks", arguments);
}

}  // namespace
}  // namespace alidade

ALIDADE_SOURCE_PLUGIN({"tracks", "tracked features of images, read from a file or a pipe",
                       alidade::kTracksKeys, &alidade::CreateTracks},
                      {"image_tracks", "features that are found in images and tracked",
                       alidade::kImageTracksKeys, &alidade::CreateImageTracks})
