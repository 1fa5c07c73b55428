// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace alidade::internal {

/// Returns the number of processors that this process may use, at least 1. It counts the
/// processors in the affinity mask, which a batch system, `taskset` or a container may restrict.
std::int64_t UsableProcessors();

}  // namespace alidade::internal
