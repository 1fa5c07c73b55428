// SPDX-License-Identifier: Apache-2.0
#include "tracks.h"

#include "alidade/host/cpp_plugin.h"
#include "alidade/host/plugin_file.h"

namespace alidade {
namespace {

constexpr const char* kImageTracksKeys =
    "path           a folder of images, in the order of their names, or a video\n"
    "images         which files of the folder: 'left_*.png'; default: all that end like an image\n"
    "state_entry    the state entry whose blocks the truth is named after; default cam";

/// By the plugin that has OpenCV, which takes long to load.
std::unique_ptr<Source> CreateImageTracks(const SourceArguments& arguments) {
  const internal::PluginOnDemand plugin = internal::OpenOnDemand(
      "image_tracks", {},
      ErrorLine(arguments.entry.place(), arguments.entry.path(),
                "this build of alidade reads no images",
                "one that found OpenCV: apt-get install libopencv-dev, then configure and build "
                "again"));
  if (plugin.table->source_count != 1) internal::Refuse(plugin.file, "is no source of tracks");
  return plugin.table->sources[0].create(arguments);
}

}  // namespace
}  // namespace alidade

ALIDADE_SOURCE_PLUGIN({"tracks", "features followed through images, from rows of a file or a pipe",
                       alidade::kTracksKeys, &alidade::CreateTracks},
                      {"image_tracks", "features found in images and followed through them",
                       alidade::kImageTracksKeys, &alidade::CreateImageTracks})
