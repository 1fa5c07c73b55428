// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

namespace alidade::internal {

/// Refuses a plugin if someone else could have written a library that the dynamic loader would load
/// with it, or could put one where that is looked for: in the RUNPATH and RPATH of the plugin and
/// of the libraries found there, or at the path that it names. Nothing of it is run. Not looked at
/// are LD_LIBRARY_PATH and the system's own folders, from which the program itself is loaded, nor
/// what the program has loaded already. Errors: kNotTrusted, kPlugin.
void CheckTrustedNeeds(const std::filesystem::path& plugin);

/// Refuses `plugin` if someone else could have written the library at `place`, or could put one
/// there where there is none.
void CheckTrustedNeed(const std::filesystem::path& plugin, const std::string& name,
                      const std::filesystem::path& place);

}  // namespace alidade::internal
