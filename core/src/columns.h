// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "alidade/source.h"
#include "alidade/state.h"
#include "alidade/system.h"

namespace alidade::internal {

/// For each block the index of its truth, or -1. A truth is named like the block (`target.depth`)
/// or like its last component (`depth`), the full name first; a last component that fits two blocks
/// fits none, and so does a truth of another size.
std::vector<int> MatchTruths(const StateLayout& layout, const std::vector<StreamInfo>& truths);

/// Why truth `t` belongs to no block of `layout`; "" where it belongs to one.
std::string WhyNoBlock(const StateLayout& layout, const std::vector<StreamInfo>& truths,
                       std::size_t t);

/// ColumnNames, or numbers for names where the space names no elements.
std::vector<std::string> AmbientNames(const std::string& name, const Space& space);
/// `name`, or `name.0`, `name.1`, ... where there are several.
std::vector<std::string> NumberedNames(const std::string& name, std::size_t size);

/// `name` or `name.element`, for each tangent element: of a vector as in ColumnNames, of a rotation
/// `name.rx`, `name.ry`, `name.rz`, of a unit vector `name.d0`, `name.d1`.
std::vector<std::string> TangentNames(const std::string& name, const Space& space);

/// The block of a position that landmarks are seen from; -1: there is none.
BlockId PathBlockOf(const System& system);

/// The unit of a block, or else of a sensor's role that it fills.
std::string UnitOf(const System& system, BlockId id);

}  // namespace alidade::internal
