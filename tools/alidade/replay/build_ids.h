// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>

namespace alidade::internal {

/// Identifies the code in this process that affects the results: the program, the libraries of
/// alidade and the C mathematics library. Returns an identity for each file name. The identity is
/// the build id from the linker. For a file without a build id, the identity is the SHA-256 of the
/// file. The entry `processor` lists the instruction sets for which the mathematics library selects
/// code. The entry `kernels` is the BestInstructionSet(). Error: kUsage if ALIDADE_KERNELS is not
/// the name of an instruction set.
std::map<std::string, std::string> BuildIds();

}  // namespace alidade::internal
