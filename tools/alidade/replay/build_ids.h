// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>

namespace alidade::internal {

/// Returns the identities of the code in this process that affects the results, by name: the
/// program, the libraries of alidade and the C mathematics library. The identity of a file is the
/// build id from the linker. Without a build id, it is the SHA-256 of the file. `processor` lists
/// the instruction sets by which the mathematics library selects code. `kernels` is the
/// BestInstructionSet(). Error: kUsage if ALIDADE_KERNELS is not the name of an instruction set.
std::map<std::string, std::string> BuildIds();

}  // namespace alidade::internal
