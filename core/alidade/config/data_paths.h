// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "alidade/config/tree.h"

namespace alidade::internal {

/// Returns the data that the source of a config reads: `source.path`, or the path of each entry of
/// `source.files`, which is relative to `source.path`. `-` is standard input.
std::vector<std::string> DataPaths(const ConfigTree& root);

}  // namespace alidade::internal
