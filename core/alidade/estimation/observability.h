// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "alidade/estimation/problem.h"

namespace alidade::internal {

/// Maximum number of state elements for UnobservableDirections: its time grows faster than the cube
/// of this number.
inline constexpr int kMaxObservabilityElements = 500;

/// Returns whether the estimated and consider blocks have at most kMaxObservabilityElements
/// elements. If not, UnobservableDirections returns no directions.
bool IsObservabilityComputed(const Problem& problem);

/// Change of the control inputs from step to step. Some directions are observable only if the
/// inputs change, such as the orientation of a body about its specific force.
enum class Excitation { kChanging, kConstant };

/// As alidade::UnobservableDirections, which uses changing inputs.
std::vector<std::vector<std::string>> UnobservableDirections(const Problem& problem,
                                                             Excitation excitation);

/// Owner of the blocks of landmarks. State entries cannot have this name.
inline constexpr const char* kLandmarks = "landmarks";

/// Problem with a fixed set of landmarks, each a block, for the analysis of observability.
struct ProblemWithLandmarks {
  Problem problem;                 ///< has no `landmarks`; their blocks and priors come last
  std::vector<BlockId> landmarks;  ///< with the representation xyz
  std::size_t known_count = 0;     ///< number of known landmarks, the first ones
  BlockId camera = -1;             ///< block of its position; -1: no sensor has this role
};

/// Returns the problem with a few landmarks in front of the camera, which every sensor of landmarks
/// measures. Returns nullopt if one of these sensors has no model for the representation xyz.
std::optional<ProblemWithLandmarks> PlaceLandmarks(const Problem& problem);

}  // namespace alidade::internal
