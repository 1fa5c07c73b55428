// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/pictures.h"

#include <system_error>

#include "alidade/host/build_plugin.h"
#include "alidade/host/plugin_file.h"

namespace alidade {
namespace {

constexpr const char* kFile = "alidade_image_writer.so";

}  // namespace

std::unique_ptr<PictureWriter> OpenPictures(const PictureArguments& arguments,
                                            const std::filesystem::path& folder) {
  const std::filesystem::path program = internal::FolderOfProgram();
  const bool known = !folder.empty() || !program.empty();  // never from the working folder
  const std::filesystem::path file = (folder.empty() ? program / "pictures" : folder) / kFile;
  std::error_code error;
  if (!known || !std::filesystem::exists(file, error)) {
    throw Error(ExitCode::kPlugin,
                ErrorLine({arguments.shown}, {}, "this build of alidade draws no pictures",
                          "one that found OpenCV: apt-get install libopencv-dev, then configure "
                          "and build again") +
                    "\n  searched " + file.string());
  }
  const BuildTable& table = internal::OpenBuildTier(file);
  if (table.pictures == nullptr) internal::Refuse(file, "draws no pictures");
  return table.pictures(arguments);
}

}  // namespace alidade
