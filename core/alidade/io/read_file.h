// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

#include "alidade/base/error.h"

namespace alidade::internal {

/// Function of the caller that throws an error: kInputMissing if the file cannot be opened or is a
/// folder, kIo if a read fails. `error` is the errno.
using ReadFailure = std::function<void(ExitCode code, int error)>;

/// Function of the caller that checks the beginning of a file before more is read. A file of
/// another kind may be endless.
using BeginningCheck = std::function<void(std::string_view beginning)>;

/// Returns the bytes of `file`, up to `max_size`. If `fail` returns, the result is the bytes that
/// were read before the failure.
std::string ReadFile(const std::filesystem::path& file, const ReadFailure& fail,
                     std::size_t max_size = std::string::npos, const BeginningCheck& check = {});

/// Returns the bytes of an open file or pipe, like ReadFile. Does not close it.
std::string ReadDescriptor(int descriptor, const ReadFailure& fail,
                           std::size_t max_size = std::string::npos,
                           const BeginningCheck& check = {});

}  // namespace alidade::internal
