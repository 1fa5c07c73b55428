// SPDX-License-Identifier: Apache-2.0
#include "alidade/state/instruction_set.h"

#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

#include "alidade/base/error.h"

namespace alidade::internal {
namespace {

std::vector<InstructionSet> FindSets() {
  std::vector<InstructionSet> found = {InstructionSet::kBaseline};
#if defined(__x86_64__)
  __builtin_cpu_init();
  const bool avx2 = __builtin_cpu_supports("avx2") != 0 && __builtin_cpu_supports("fma") != 0;
  if (avx2) found.push_back(InstructionSet::kAvx2);
  if (avx2 && __builtin_cpu_supports("avx512f") != 0) found.push_back(InstructionSet::kAvx512);
#endif
  return found;
}

}  // namespace

const char* ToString(InstructionSet set) {
  static constexpr const char* kNames[] = {"baseline", "AVX2", "AVX-512"};
  return kNames[static_cast<int>(set)];
}

std::span<const InstructionSet> AllInstructionSets() {
  static const std::vector<InstructionSet> all = FindSets();
  return all;
}

InstructionSet BestInstructionSet() {
  static const InstructionSet best = [] {
    const char* const asked = std::getenv("ALIDADE_KERNELS");
    if (asked == nullptr || *asked == '\0') return AllInstructionSets().back();
    std::string names;
    for (const InstructionSet set : AllInstructionSets()) {
      if (std::string_view(asked) == ToString(set)) return set;
      names.append(names.empty() ? "" : ", ").append(ToString(set));
    }
    throw Error(ExitCode::kUsage, "environment variable ALIDADE_KERNELS: '" + std::string(asked) +
                                      "' is none of the kernels of this processor: " + names);
  }();
  return best;
}

}  // namespace alidade::internal
