// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/images.h"

#include "alidade/plugin/load.h"

namespace alidade {

std::unique_ptr<ImageWriter> OpenImageWriter(const ImageArguments& arguments,
                                             const std::filesystem::path& folder) {
  const bool window = arguments.form == ImageArguments::Form::kWindow;
  const void* const factory = internal::FactoryOnDemand(
      kImageWriterKind, window ? "image_window" : "images", folder,
      ErrorLine({arguments.shown}, {},
                window ? "this build of alidade cannot open windows"
                       : "this build of alidade cannot write images",
                "a build with OpenCV: run 'apt-get install libopencv-dev', then configure and "
                "build again"));
  return static_cast<const ImageWriterEntry*>(factory)->create(arguments);
}

}  // namespace alidade
