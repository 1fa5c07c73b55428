// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "alidade/config/tree.h"

/// Errors about missing or unknown keys. Each error suggests the key that the author of the config
/// probably meant: a key with another unit, or with a similar spelling.
namespace alidade::internal {

/// Throws the error of the missing `key`. The message reports that `needed_by` needs the key,
/// unless `needed_by` is empty. If `map` contains a similar unknown key, the message names this
/// key; otherwise it contains `expected`.
[[noreturn]] void FailMissing(const ConfigTree& map, std::string_view key,
                              std::string_view needed_by, std::string_view expected);

/// Appends an error line for each unknown key of `map` and of each nested map from which at least
/// one key was read. Stops after 20 lines.
void ListUnread(const ConfigTree& map, std::vector<std::string>& lines);

}  // namespace alidade::internal
