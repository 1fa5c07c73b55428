// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "alidade/base/text_table.h"
#include "alidade/system/system.h"

namespace alidade::internal {

/// How the landmarks of a system that has some are initialised, converted and pruned: what, and
/// how.
std::vector<TextRow> LandmarkRows(const System& system);

}  // namespace alidade::internal
