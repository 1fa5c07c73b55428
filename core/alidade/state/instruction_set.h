// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

namespace alidade::internal {

/// Set of vector instructions for which kernels are compiled. The build requires only the baseline.
/// The set is selected at run time, by the features of the processor.
enum class InstructionSet { kBaseline, kAvx2, kAvx512 };

/// Returns `baseline`, `AVX2` or `AVX-512`.
const char* ToString(InstructionSet set);
/// Returns the sets of this processor. The last one is the best.
std::span<const InstructionSet> AllInstructionSets();
/// Returns the best set, or the set that the environment variable ALIDADE_KERNELS names. Error
/// kUsage if this processor does not have it.
InstructionSet BestInstructionSet();

}  // namespace alidade::internal
