// SPDX-License-Identifier: Apache-2.0
#include "alidade/sweep/processors.h"

#include <sched.h>

#include <algorithm>
#include <thread>

namespace alidade::internal {

std::int64_t UsableProcessors() {
  cpu_set_t usable;
  // A cpu_set_t represents 1024 processors. On a larger machine the call fails, and all processors
  // are counted.
  if (::sched_getaffinity(0, sizeof usable, &usable) == 0) return CPU_COUNT(&usable);
  return std::max<std::int64_t>(1, std::thread::hardware_concurrency());
}

}  // namespace alidade::internal
