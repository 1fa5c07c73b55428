// SPDX-License-Identifier: Apache-2.0
#define BOOST_DLL_USE_STD_FS
#include <boost/dll/shared_library.hpp>
#include <system_error>

#include "alidade/host/build_plugin.h"
#include "alidade/host/plugin_file.h"

namespace alidade::internal {

const BuildTable& OpenBuildTier(const std::filesystem::path& file) {
  const AlidadeFingerprint fingerprint = ReadFingerprint(file);
  if (fingerprint.tier != ALIDADE_TIER_BUILD) Refuse(file, "holds models alone");
  CheckBuild(fingerprint, file);
  CheckTrusted(file);
  const std::string failure = TrialLoad(file, fingerprint.tier);
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

}  // namespace alidade::internal
