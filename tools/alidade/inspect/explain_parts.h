// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "alidade/base/text_table.h"
#include "alidade/system/system.h"

namespace alidade::internal {

/// How the landmarks of a system that has some enter the state, change and leave it: what, and how.
std::vector<TextRow> LandmarkRows(const System& system);

}  // namespace alidade::internal
