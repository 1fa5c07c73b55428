// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "alidade/base/error.h"

namespace alidade::internal {

/// A file that is written from front to end, every write checked. A limit on the file size is an
/// error like a full disk, not the end of the process. What Write is given is whole: after an error
/// the file ends with the last text that fits in, and takes no more. A text waits for at most a
/// second, as long as others follow, before it is the operating system's.
class OutputFile {
 public:
  /// Creates `file`; messages call it `shown`. Errors: kCannotCreate, kIo.
  OutputFile(const std::filesystem::path& file, std::string shown);
  /// Writes and closes, without a word, what Close() has not closed.
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// Error: kIo.
  void Write(std::string_view text);
  /// Gives what is buffered to the operating system now. Error: kIo.
  void Flush();
  /// Writes what is buffered and closes. Error: kIo.
  void Close();

 private:
  std::string shown_;
  std::string buffer_;
  std::vector<std::size_t> ends_;  ///< of the texts in the buffer
  std::uint64_t size_ = 0;         ///< of the file
  std::chrono::steady_clock::time_point flushed_ = std::chrono::steady_clock::now();
  int fd_ = -1;
  int error_ = 0;  ///< of the write that failed
};

/// Says why `path` could not be created: kIo where the disk is at fault, else kCannotCreate.
[[noreturn]] void FailCreate(const std::string& path, int error_number);
/// Error kIo: `PATH: cannot VERB: REASON`.
[[noreturn]] void FailIo(const std::string& path, const char* verb, int error_number);

/// fsync of a file or folder. Error: kIo.
void Sync(const std::filesystem::path& path, const std::string& shown);

}  // namespace alidade::internal
