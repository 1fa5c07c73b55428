// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "alidade/estimation/problem.h"

namespace alidade::internal {

/// Up to how many elements of the state UnobservableDirections looks: its time grows faster than
/// their number cubed.
inline constexpr int kMostObserved = 500;

/// Whether the estimated and consider blocks have at most kMostObserved elements; where not,
/// UnobservableDirections gives none.
bool ObservabilityIsTold(const Problem& problem);

/// Whether control inputs change from step to step. A direction that only a change shows, such as
/// the orientation of a body about its specific force, is unobservable under constant ones.
enum class Excitation { kChanging, kConstant };

/// As alidade::UnobservableDirections, which has changing inputs.
std::vector<std::vector<std::string>> UnobservableDirections(const Problem& problem,
                                                             Excitation excitation);

/// Owner of the blocks of landmarks; no state entry has this name.
inline constexpr const char* kLandmarks = "landmarks";

/// A problem whose landmarks are blocks of their own, to see what can be observed.
struct WithLandmarks {
  Problem problem;                 ///< has no `landmarks`; these blocks and priors come last
  std::vector<BlockId> landmarks;  ///< of the representation xyz
  std::size_t known = 0;           ///< so many of them are where they are known to be
  BlockId camera = -1;             ///< its position; -1: no sensor has one
};

/// The problem with a few points before the camera in the place of landmarks to come, seen by every
/// sensor of landmarks. None where one of these has no landmarks of the representation xyz.
std::optional<WithLandmarks> PlaceLandmarks(const Problem& problem);

}  // namespace alidade::internal
