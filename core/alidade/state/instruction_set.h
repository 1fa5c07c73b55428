// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

namespace alidade::internal {

/// Set of vector instructions for which kernels are compiled. The program requires only the
/// baseline. It selects the set at run time, according to the features of the processor.
enum class InstructionSet { kBaseline, kAvx2, kAvx512 };

/// Returns `baseline`, `AVX2` or `AVX-512`.
const char* ToString(InstructionSet set);
/// Returns the sets that this processor supports, from slowest to fastest.
std::span<const InstructionSet> AllInstructionSets();
/// Returns the fastest set, or the set that the environment variable ALIDADE_KERNELS names. Error:
/// kUsage if this processor does not support the named set.
InstructionSet BestInstructionSet();

}  // namespace alidade::internal
