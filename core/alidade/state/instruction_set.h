// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

namespace alidade::internal {

/// Set of vector instructions for which kernels are compiled. The program requires only the
/// baseline set. The program selects the set at run time, according to the features of the
/// processor.
enum class InstructionSet { kBaseline, kAvx2, kAvx512 };

/// Returns `baseline`, `AVX2` or `AVX-512`.
const char* ToString(InstructionSet set);
/// Returns the sets that this processor supports, from slowest to fastest.
std::span<const InstructionSet> AllInstructionSets();
/// Returns the set that the environment variable ALIDADE_KERNELS names. If the variable is not set,
/// returns the fastest supported set. Throws Error kUsage if this processor does not support the
/// named set.
InstructionSet BestInstructionSet();

}  // namespace alidade::internal
