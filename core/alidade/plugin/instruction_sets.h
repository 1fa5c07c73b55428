// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

/// What this processor can run, in the bits ALIDADE_ISA_* of plugin_abi.h.
namespace alidade::internal {

/// Those that it has and the operating system saves the registers of.
std::uint32_t InstructionSetsOfProcessor();

/// `AVX2, FMA`; of a bit that this version does not know its number.
std::string InstructionSetNames(std::uint32_t isa);

}  // namespace alidade::internal
