// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "alidade/estimation/problem.h"

namespace alidade::internal {

/// Maximum number of state elements for which UnobservableDirections is computed. The number is
/// limited, because the computing time grows faster than its cube.
inline constexpr int kMaxObservabilityElements = 500;

/// Returns whether the estimated and consider blocks have at most kMaxObservabilityElements
/// elements. If they have more elements, UnobservableDirections returns an empty list.
bool IsObservabilityComputed(const Problem& problem);

/// Whether the control inputs change from step to step. Some directions, such as the rotation of a
/// body about its specific force, are observable only if the inputs change.
enum class Excitation { kChanging, kConstant };

/// Returns the directions that are unobservable with control inputs of this excitation. See
/// alidade::UnobservableDirections, which uses changing inputs.
std::vector<std::vector<std::string>> UnobservableDirections(const Problem& problem,
                                                             Excitation excitation);

/// Name of the owner of landmark blocks. A state entry of a config cannot have this name.
inline constexpr const char* kLandmarks = "landmarks";

/// Problem with a fixed set of landmarks, for the analysis of observability. Each landmark is a
/// block.
struct ProblemWithLandmarks {
  Problem problem;                 ///< `landmarks` is not set; blocks of landmarks come last
  std::vector<BlockId> landmarks;  ///< blocks of the landmarks, with the representation xyz
  std::size_t known_count = 0;     ///< number of known landmarks, which come first
  BlockId camera = -1;             ///< block of the camera position; -1: no such block
};

/// Returns a copy of the problem with a few landmarks in front of the camera. Every landmark sensor
/// measures all of these landmarks. Returns nullopt if the problem has no landmarks, or if a
/// landmark sensor has no model for the representation xyz.
std::optional<ProblemWithLandmarks> PlaceLandmarks(const Problem& problem);

}  // namespace alidade::internal
