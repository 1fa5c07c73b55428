// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>

namespace alidade::internal {

/// Returns the identities of the code that computes in this process, by name: the program, the
/// libraries of alidade and the C mathematics library. Each is identified by the build id from its
/// linker, or by the SHA-256 of the file if it has no build id. `processor` lists the instruction
/// sets by which the mathematics library selects its code; `kernels` is the BestInstructionSet.
/// Error: kUsage if ALIDADE_KERNELS does not name an instruction set.
std::map<std::string, std::string> BuildIds();

}  // namespace alidade::internal
