// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

#include "alidade/base/error.h"

namespace alidade::internal {

/// Callback that throws an error. `code` is kInputMissing if the file cannot be opened or is a
/// folder, and kIo if a read fails. `error` is the errno.
using ReadFailure = std::function<void(ExitCode code, int error)>;

/// Callback that checks the beginning of a file before the remainder is read. The callback can thus
/// reject a file of a wrong kind, which may be endless.
using BeginningCheck = std::function<void(std::string_view beginning)>;

/// Returns the bytes of `file`, but at most the first `max_size` bytes. If `fail` does not throw,
/// ReadFile returns the bytes that were read before the failure.
std::string ReadFile(const std::filesystem::path& file, const ReadFailure& fail,
                     std::size_t max_size = std::string::npos, const BeginningCheck& check = {});

/// Returns the bytes of an open file or pipe, by the rules of ReadFile. Does not close
/// `descriptor`.
std::string ReadDescriptor(int descriptor, const ReadFailure& fail,
                           std::size_t max_size = std::string::npos,
                           const BeginningCheck& check = {});

}  // namespace alidade::internal
