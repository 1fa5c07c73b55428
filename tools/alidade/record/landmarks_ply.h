// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "alidade/estimation/landmarks.h"

namespace alidade::internal {

/// Returns the landmarks with finite positions and standard deviations as the text of an ASCII PLY
/// file: x, y, z (world, m), sigma_x, sigma_y, sigma_z (m), removed (0 or 1) and id of each.
std::string LandmarksPly(const std::vector<LandmarkEstimate>& landmarks);

}  // namespace alidade::internal
