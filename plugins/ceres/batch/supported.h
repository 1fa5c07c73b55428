// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/config/config.h"
#include "alidade/filter/support.h"

namespace alidade::ceres_batch {

/// Refuses by name what `system` asks for beyond `support`: an Error at `entry`, the config's entry
/// of the estimator, of which `type` is the type.
void CheckSupported(const System& system, const Node& entry, const char* type,
                    const Support& support);

}  // namespace alidade::ceres_batch
