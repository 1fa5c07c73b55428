// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <set>
#include <string>

#include "alidade/model/plugin_abi.h"

/// Sections of a plugin's file that describe the plugin. They are read before the plugin is loaded.
namespace alidade {

/// Reads the build tag from the `.alidade` section of a plugin's file. Errors: kPlugin if the build
/// tag is missing or malformed, or is for another plugin ABI.
AlidadeBuildTag ReadBuildTag(const std::filesystem::path& file);

namespace internal {

/// Returns false if the plugin lists the names of its entries and the list contains none of
/// `names`. The plugin then need not be loaded.
bool MayOffer(const std::filesystem::path& file, const std::set<std::string>& names);

}  // namespace internal

}  // namespace alidade
