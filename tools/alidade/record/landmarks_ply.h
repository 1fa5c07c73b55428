// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "alidade/estimation/landmarks.h"

namespace alidade::internal {

/// Those landmarks whose place and standard deviations are finite, as an ASCII file of the PLY
/// format: x, y, z (world, m), sigma_x, sigma_y, sigma_z (m), removed (0 or 1) and id of each.
std::string LandmarksPly(const std::vector<LandmarkEstimate>& landmarks);

}  // namespace alidade::internal
