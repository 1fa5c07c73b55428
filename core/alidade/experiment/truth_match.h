// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "alidade/estimation/frame.h"
#include "alidade/state/state.h"

namespace alidade::internal {

/// Returns the index of the truth of each block, or -1 if the block has no truth. A truth has the
/// name of its block (`target.depth`) or the last component of that name (`depth`); the full name
/// has precedence. A last component that several blocks share does not match any block. A truth
/// does not match a block of another size either.
std::vector<int> MatchTruths(const StateLayout& layout, const std::vector<StreamInfo>& truths);

/// Returns the reason why truth `t` does not match any block of `layout`, or "" if it matches a
/// block.
std::string WhyNoBlock(const StateLayout& layout, const std::vector<StreamInfo>& truths,
                       std::size_t t);

}  // namespace alidade::internal
