// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

#include "alidade/base/error.h"

namespace alidade::internal {

/// Throws the error of a caller: kInputMissing if the file cannot be opened or is a folder, kIo if
/// a read fails. `error` is the errno.
using ReadFailure = std::function<void(ExitCode code, int error)>;

/// Is shown the beginning of a file before the rest is read: what is no such file may have no end.
using ReadLook = std::function<void(std::string_view beginning)>;

/// The bytes of `file`, at most the first `most` of them. If `fail` returns: those read so far.
std::string ReadFile(const std::filesystem::path& file, const ReadFailure& fail,
                     std::size_t most = std::string::npos, const ReadLook& look = {});

/// Likewise, of an open file or pipe, which stays open.
std::string ReadDescriptor(int descriptor, const ReadFailure& fail,
                           std::size_t most = std::string::npos, const ReadLook& look = {});

}  // namespace alidade::internal
