// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/system/system.h"

namespace alidade::internal {

/// Up to how many elements of the state UnobservableDirections looks: its time grows faster than
/// their number cubed.
inline constexpr int kMostObserved = 500;

/// Whether the estimated and consider blocks have at most kMostObserved elements; where not,
/// UnobservableDirections gives none.
bool ObservabilityIsTold(const System& system);

/// Whether control inputs change from step to step. A direction that only a change shows, such as
/// the orientation of a body about its specific force, is unobservable under constant ones.
enum class Excitation { kChanging, kConstant };

/// As alidade::UnobservableDirections, which has changing inputs.
std::vector<std::vector<std::string>> UnobservableDirections(const System& system,
                                                             Excitation excitation);

}  // namespace alidade::internal
