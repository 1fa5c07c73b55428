// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fstream>
#include <string>

#include "support/sanitized.h"

namespace alidade::testing {

/// Returns the peak resident memory of this process in KiB. Returns 0 in a sanitizer build, which
/// does not return freed memory to the heap.
inline long PeakMemory() {
  if (kSanitized) return 0;
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;) {
    if (word != "VmHWM:") continue;
    status >> word;
    return std::stol(word);
  }
  return 0;
}

}  // namespace alidade::testing
