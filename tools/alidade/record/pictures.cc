// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/pictures.h"

#include "alidade/host/build_plugin.h"
#include "alidade/host/plugin_file.h"

namespace alidade {

std::unique_ptr<PictureWriter> OpenPictures(const PictureArguments& arguments,
                                            const std::filesystem::path& folder) {
  const internal::PluginOnDemand plugin = internal::OpenOnDemand(
      "pictures", folder,
      ErrorLine({arguments.shown}, {}, "this build of alidade draws no pictures",
                "one that found OpenCV: apt-get install libopencv-dev, then configure and build "
                "again"));
  if (plugin.table->pictures == nullptr) internal::Refuse(plugin.file, "draws no pictures");
  return plugin.table->pictures(arguments);
}

}  // namespace alidade
