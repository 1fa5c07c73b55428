// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

/// Instruction sets of this processor, as the bits ALIDADE_ISA_* of plugin_abi.h.
namespace alidade::internal {

/// Returns the instruction sets that the processor supports and whose registers the operating
/// system saves.
std::uint32_t InstructionSetsOfProcessor();

/// Returns the names of instruction sets, such as `AVX2, FMA`. The text for an unknown bit contains
/// the number of the bit.
std::string InstructionSetNames(std::uint32_t isa);

}  // namespace alidade::internal
