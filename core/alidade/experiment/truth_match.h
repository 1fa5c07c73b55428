// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "alidade/estimation/frame.h"
#include "alidade/state/state.h"

namespace alidade::internal {

/// Returns the index of the truth of each block, or -1. A truth has the name of its block
/// (`target.depth`) or the last component of that name (`depth`); a full name has precedence. A
/// last component that fits two blocks, or a truth of another size, does not match.
std::vector<int> MatchTruths(const StateLayout& layout, const std::vector<StreamInfo>& truths);

/// Returns why truth `t` does not match a block of `layout`, or "" if it matches one.
std::string WhyNoBlock(const StateLayout& layout, const std::vector<StreamInfo>& truths,
                       std::size_t t);

}  // namespace alidade::internal
