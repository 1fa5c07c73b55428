// SPDX-License-Identifier: Apache-2.0
#define BOOST_DLL_USE_STD_FS
#include <boost/dll/shared_library.hpp>
#include <system_error>
#include <vector>

#include "alidade/host/build_plugin.h"
#include "alidade/host/plugin_file.h"

namespace alidade::internal {

const BuildTable& OpenBuildTier(const std::filesystem::path& file) {
  const AlidadeBuildTag build_tag = ReadBuildTag(file);
  if (build_tag.kind != ALIDADE_PLUGIN_CPP) Refuse(file, "holds models alone");
  CheckBuild(build_tag, file);
  CheckTrusted(file);
  const std::string failure = TrialLoad(file, build_tag.kind);
  if (!failure.empty()) Refuse(file, failure);
  try {
    using boost::dll::load_mode::rtld_local;
    using boost::dll::load_mode::rtld_now;
    const auto& library = *new boost::dll::shared_library(file, rtld_now | rtld_local);
    return *library.get<const BuildTable*()>(kBuildEntrySymbol)();
  } catch (const std::system_error& e) {
    Refuse(file, std::string("cannot be loaded: ") + e.what());
  }
}

PluginOnDemand OpenOnDemand(const std::string& name, const std::filesystem::path& folder,
                            const std::string& missing) {
  std::filesystem::path searched = folder;
  if (searched.empty()) {
    const std::filesystem::path program = FolderOfProgram();
    if (!program.empty()) searched = program / name;  // never the working folder
  }
  std::vector<std::filesystem::path> files;
  std::error_code error;
  std::filesystem::directory_iterator at(searched, error);
  for (; !error && at != std::filesystem::directory_iterator(); at.increment(error)) {
    if (at->path().extension() == ".so") files.push_back(at->path());
  }
  if (files.empty()) {
    throw Error(ExitCode::kPlugin, missing + "\n  searched " + searched.string());
  }
  if (files.size() > 1)
    Refuse(searched, "holds " + std::to_string(files.size()) + " plugins; expected one");
  return {files.front(), &OpenBuildTier(files.front())};
}

}  // namespace alidade::internal
