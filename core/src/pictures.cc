// SPDX-License-Identifier: Apache-2.0
#include "alidade/pictures.h"

#define BOOST_DLL_USE_STD_FS
#include <boost/dll/shared_library.hpp>
#include <system_error>

#include "alidade/build_plugin.h"
#include "plugin_file.h"

namespace alidade {
namespace {

constexpr const char* kFile = "alidade_image_writer.so";

/// Opens the plugin for the rest of the process, checked as PluginHost checks all.
const BuildTable& Load(const std::filesystem::path& file) {
  const AlidadeFingerprint fingerprint = ReadFingerprint(file);
  if (fingerprint.tier != ALIDADE_TIER_BUILD) internal::Refuse(file, "draws no pictures");
  internal::CheckBuild(fingerprint, file);
  CheckTrusted(file);
  const std::string failure = internal::TrialLoad(file, fingerprint.tier);
  if (!failure.empty()) internal::Refuse(file, failure);
  try {
    using boost::dll::load_mode::rtld_local;
    using boost::dll::load_mode::rtld_now;
    const auto& library = *new boost::dll::shared_library(file, rtld_now | rtld_local);
    const BuildTable& table = *library.get<const BuildTable*()>(kBuildEntrySymbol)();
    if (table.pictures == nullptr) internal::Refuse(file, "draws no pictures");
    return table;
  } catch (const std::system_error& e) {
    internal::Refuse(file, std::string("cannot be loaded: ") + e.what());
  }
}

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
  return Load(file).pictures(arguments);
}

}  // namespace alidade
