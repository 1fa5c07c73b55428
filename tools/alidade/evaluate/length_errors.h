// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "alidade/evaluate/evaluate.h"

namespace alidade::internal {

/// Relative errors of all pairs of poses that are `length_m` apart along the trajectory.
struct LengthErrors {
  double length_m = 0.0;
  std::vector<double> translations;  ///< |translation error| / length_m, ascending
  std::vector<double> angles_deg;    ///< ascending
};

/// Computes the relative errors over the lengths 1, 2 and 5 times a power of ten, up to half the
/// length of the trajectory. A pair deviates from a length by at most 10 %. At most eight lengths
/// are returned, the largest. Pose i of both trajectories must match.
std::vector<LengthErrors> ErrorsOverLengths(const Trajectory& reference,
                                            const Trajectory& estimate);

}  // namespace alidade::internal
