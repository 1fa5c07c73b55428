// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "alidade/model/plugin_abi.h"
#include "alidade/plugin/cpp_plugin.h"

namespace alidade::internal {

/// Whether the entry is of a kind that this version knows; another is left out.
bool IsKnown(const AlidadeEntry& entry);

/// What breaks the rules of plugin_abi.h or cpp_plugin.h in a table, or "".
std::string Defect(const AlidadeTable* table);
std::string Defect(const CppPluginTable* table);

}  // namespace alidade::internal
