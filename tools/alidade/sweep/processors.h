// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace alidade::internal {

/// The processors that this process may use, at least 1: those of its affinity mask, which a batch
/// system, `taskset` or a container may have made smaller than the machine.
std::int64_t UsableProcessors();

}  // namespace alidade::internal
