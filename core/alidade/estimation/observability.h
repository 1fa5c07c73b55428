// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "alidade/estimation/problem.h"

namespace alidade::internal {

/// Maximum number of state elements for which UnobservableDirections is computed, because the
/// computing time grows faster than the cube of this number.
inline constexpr int kMaxObservabilityElements = 500;

/// Returns whether the estimated and consider blocks have at most kMaxObservabilityElements
/// elements. If not, UnobservableDirections returns no directions.
bool IsObservabilityComputed(const Problem& problem);

/// Whether the control inputs change from step to step. Some directions are observable only if the
/// inputs change, such as the rotation of a body about its specific force.
enum class Excitation { kChanging, kConstant };

/// Does the same as alidade::UnobservableDirections, which uses changing inputs.
std::vector<std::vector<std::string>> UnobservableDirections(const Problem& problem,
                                                             Excitation excitation);

/// Name of the owner of landmark blocks. State entries cannot have this name.
inline constexpr const char* kLandmarks = "landmarks";

/// Problem with a fixed set of landmarks, for the analysis of observability. Each landmark is a
/// block.
struct ProblemWithLandmarks {
  Problem problem;                 ///< `landmarks` is not set; their blocks and priors come last
  std::vector<BlockId> landmarks;  ///< blocks of the landmarks, with the representation xyz
  std::size_t known_count = 0;     ///< number of known landmarks, which come first
  BlockId camera = -1;             ///< block of the camera position; -1: no sensor has this role
};

/// Adds a few landmarks in front of the camera to a copy of the problem. Every sensor of landmarks
/// measures them. Returns nullopt if such a sensor has no model for the representation xyz.
std::optional<ProblemWithLandmarks> PlaceLandmarks(const Problem& problem);

}  // namespace alidade::internal
