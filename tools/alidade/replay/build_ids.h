// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>

namespace alidade::internal {

/// What computes in this process, by name: the program, the libraries of alidade and that of the C
/// mathematics, each with the build id that its linker gave it (the SHA-256 of the file where it
/// gave none); `processor`, whose instruction sets the last of them chooses by, and `kernels`, the
/// BestInstructionSet. Error: kUsage where ALIDADE_KERNELS names none of them.
std::map<std::string, std::string> BuildIds();

}  // namespace alidade::internal
