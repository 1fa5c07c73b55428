// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/system.h"

namespace alidade::internal {

/// Up to how many elements of the state UnobservableDirections looks: its time grows faster than
/// their number cubed.
inline constexpr int kMostObserved = 500;

/// Whether the estimated and considered blocks have at most kMostObserved elements; where not,
/// UnobservableDirections gives none.
bool ObservabilityIsTold(const System& system);

}  // namespace alidade::internal
