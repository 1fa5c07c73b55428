// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "alidade/base/error.h"

namespace alidade::internal {

/// A file that is written from front to end, every write checked. A limit on the file size is an
/// error like a full disk, not the end of the process.
class OutputFile {
 public:
  /// Creates `file`; messages call it `shown`. Errors: kCannotCreate, kIo.
  OutputFile(const std::filesystem::path& file, std::string shown);
  /// Closes without a word what Close() has not closed; what is buffered is lost.
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// Error: kIo.
  void Write(std::string_view text);
  /// Writes what is buffered and closes. Error: kIo.
  void Close();

 private:
  void Flush();

  std::string shown_;
  std::string buffer_;
  int fd_ = -1;
};

/// Says why `path` could not be created: kIo where the disk is at fault, else kCannotCreate.
[[noreturn]] void FailCreate(const std::string& path, int error_number);
/// Error kIo: `PATH: cannot VERB: REASON`.
[[noreturn]] void FailIo(const std::string& path, const char* verb, int error_number);

/// fsync of a file or folder. Error: kIo.
void Sync(const std::filesystem::path& path, const std::string& shown);

}  // namespace alidade::internal
