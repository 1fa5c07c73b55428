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
  std::vector<InstructionSet> sets = {InstructionSet::kBaseline};
#if defined(__x86_64__)
  __builtin_cpu_init();
  const bool has_avx2 = __builtin_cpu_supports("avx2") != 0 && __builtin_cpu_supports("fma") != 0;
  if (has_avx2) sets.push_back(InstructionSet::kAvx2);
  if (has_avx2 && __builtin_cpu_supports("avx512f") != 0) sets.push_back(InstructionSet::kAvx512);
#endif
  return sets;
}

}  // namespace

const char* ToString(InstructionSet set) {
  static constexpr const char* kNames[] = {"baseline", "AVX2", "AVX-512"};
  return kNames[static_cast<int>(set)];
}

std::span<const InstructionSet> AllInstructionSets() {
  static const std::vector<InstructionSet> sets = FindSets();
  return sets;
}

InstructionSet BestInstructionSet() {
  static const InstructionSet best = [] {
    const char* const requested = std::getenv("ALIDADE_KERNELS");
    if (requested == nullptr || *requested == '\0') return AllInstructionSets().back();
    std::string names;
    for (const InstructionSet set : AllInstructionSets()) {
      if (std::string_view(requested) == ToString(set)) return set;
      names.append(names.empty() ? "" : ", ").append(ToString(set));
    }
    throw Error(ExitCode::kUsage, "environment variable ALIDADE_KERNELS: the instruction set '" +
                                      std::string(requested) +
                                      "' is not available on this processor; expected one of " +
                                      names);
  }();
  return best;
}

}  // namespace alidade::internal
