// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "alidade/config/tree.h"

/// Errors about missing or unknown keys. They suggest the key that was probably meant: a key with
/// another unit, or with almost the same letters.
namespace alidade::internal {

/// Throws the error of the missing `key`. The message reports that `needed_by` needs the key,
/// unless `needed_by` is empty.
[[noreturn]] void FailMissing(const ConfigTree& map, std::string_view key,
                              std::string_view needed_by);

/// Appends a line for each unknown key of `map`, and of each map below from which a key was read.
void ListUnread(const ConfigTree& map, std::vector<std::string>& lines);

}  // namespace alidade::internal
