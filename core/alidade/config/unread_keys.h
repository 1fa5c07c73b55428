// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "alidade/config/tree.h"

/// Errors about keys that are missing or unknown, with the key that was probably meant: one of
/// another unit, or of nearly the same letters.
namespace alidade::internal {

/// Throws the error of the missing `key`; `needed_by` names who needs it, or is empty.
[[noreturn]] void FailMissing(const ConfigTree& map, std::string_view key,
                              std::string_view needed_by);

/// Appends a line for each key that was not asked for, of `map` and of the maps in it that were
/// read.
void ListUnread(const ConfigTree& map, std::vector<std::string>& lines);

}  // namespace alidade::internal
