// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace alidade::internal {

/// Returns the number of processors in the affinity mask of this process, at least 1. A batch
/// system, `taskset` or a container may restrict the affinity mask.
std::int64_t UsableProcessors();

}  // namespace alidade::internal
