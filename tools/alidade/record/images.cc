// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/images.h"

#include "alidade/plugin/cpp_plugin.h"
#include "alidade/plugin/plugin_file.h"

namespace alidade {

std::unique_ptr<ImageWriter> OpenImageWriter(const ImageArguments& arguments,
                                             const std::filesystem::path& folder) {
  const bool window = arguments.form == ImageArguments::Form::kWindow;
  const internal::PluginOnDemand plugin = internal::OpenOnDemand(
      window ? "image_window" : "images", folder,
      ErrorLine({arguments.shown}, {},
                window ? "this build of alidade opens no windows"
                       : "this build of alidade draws no images",
                "one that found OpenCV: apt-get install libopencv-dev, then configure and build "
                "again"));
  if (plugin.table->images == nullptr) internal::Refuse(plugin.file, "draws no images");
  return plugin.table->images(arguments);
}

}  // namespace alidade
