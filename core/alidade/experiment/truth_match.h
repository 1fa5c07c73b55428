// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "alidade/estimation/frame.h"
#include "alidade/state/state.h"

namespace alidade::internal {

/// For each block the index of its truth, or -1. A truth is named like the block (`target.depth`)
/// or like its last component (`depth`), the full name first; a last component that fits two blocks
/// fits none, and so does a truth of another size.
std::vector<int> MatchTruths(const StateLayout& layout, const std::vector<StreamInfo>& truths);

/// Why truth `t` belongs to no block of `layout`; "" where it belongs to one.
std::string WhyNoBlock(const StateLayout& layout, const std::vector<StreamInfo>& truths,
                       std::size_t t);

}  // namespace alidade::internal
