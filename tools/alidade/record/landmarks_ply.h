// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "alidade/estimation/landmarks.h"

namespace alidade::internal {

/// Returns the text of an ASCII PLY file with the landmarks whose positions and standard deviations
/// are finite. The properties are x, y, z (world frame, m), sigma_x, sigma_y, sigma_z (m), removed
/// (0 or 1) and id.
std::string LandmarksPly(const std::vector<LandmarkEstimate>& landmarks);

}  // namespace alidade::internal
