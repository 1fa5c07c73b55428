// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <fstream>
#include <string>

#include "alidade/io/json.h"

/// Access to the files of a finished run, comparison or sweep. Errors: kInputMissing if a file is
/// missing, kBadData if it is invalid.
namespace alidade::internal {

/// Throws kBadData with the file and the line; line 0 means the whole file.
[[noreturn]] void FailFile(const std::filesystem::path& file, int line, const std::string& message);
/// Refuses a path that is not a regular file. Reading from a pipe could block the program.
void RequireFile(const std::filesystem::path& file);
std::ifstream OpenFile(const std::filesystem::path& file);
/// Reads a JSON file of at most 256 MiB.
Json ReadJsonFile(const std::filesystem::path& file);

}  // namespace alidade::internal
