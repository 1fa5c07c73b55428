// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

namespace alidade::internal {

/// A set of vector instructions that kernels are compiled for. The build asks for the baseline
/// alone; the processor is asked at run time.
enum class InstructionSet { kBaseline, kAvx2, kAvx512 };

/// `baseline`, `AVX2`, `AVX-512`.
const char* ToString(InstructionSet set);
/// Those of this processor, the best last.
std::span<const InstructionSet> AllInstructionSets();
/// The best one, or the one that the environment variable ALIDADE_KERNELS names. Error kUsage if it
/// names none of them.
InstructionSet BestInstructionSet();

}  // namespace alidade::internal
