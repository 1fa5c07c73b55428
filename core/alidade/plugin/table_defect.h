// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "alidade/model/plugin_abi.h"
#include "alidade/plugin/cpp_plugin.h"

namespace alidade::internal {

/// Returns true if this version knows the kind of the entry. An entry of an unknown kind is
/// ignored.
bool IsKnown(const AlidadeEntry& entry);

/// Returns the reason why a table breaks the rules of plugin_abi.h or cpp_plugin.h; "" if it breaks
/// none.
std::string TableDefect(const AlidadeTable* table);
std::string TableDefect(const CppPluginTable* table);

}  // namespace alidade::internal
