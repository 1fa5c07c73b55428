// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <set>
#include <string>

#include "alidade/model/plugin_abi.h"

/// What a plugin says of itself in sections of its file, which are read before it is opened.
namespace alidade {

/// The build tag in the `.alidade` section of a plugin, read from its bytes. Errors: kPlugin (no
/// build tag, a malformed one, another plugin ABI).
AlidadeBuildTag ReadBuildTag(const std::filesystem::path& file);

namespace internal {

/// False if the plugin lists the names of its entries and none of `names` is among them. Such a
/// plugin may stay closed.
bool MayOffer(const std::filesystem::path& file, const std::set<std::string>& names);

}  // namespace internal

}  // namespace alidade
