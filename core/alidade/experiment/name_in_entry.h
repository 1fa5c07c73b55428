// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "alidade/state/state.h"

namespace alidade::internal {

/// Returns the name of a block without that of its entry: `depth` for `target.depth`.
inline std::string NameInEntry(const Block& block) {
  return block.name.substr(block.owner.size() + 1);
}

}  // namespace alidade::internal
