// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <filesystem>
#include <string>
#include <string_view>

#include "alidade/base/error.h"

namespace alidade::internal {

/// File that is written sequentially and reports every write error. Text is buffered for at most a
/// second, as long as more text follows.
class OutputFile {
 public:
  enum class Mode { kReplace, kAppend };

  /// Creates `file`, or opens one that exists. Errors: kCannotCreate, kIo.
  explicit OutputFile(std::filesystem::path file, Mode mode = Mode::kReplace);
  /// Closes the file without reporting errors, unless Close() was called.
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// Appends a text. Error: kIo; the file then accepts no further text, and may end in the middle
  /// of one.
  void Write(std::string_view text);
  /// Writes the buffer to the operating system now. Error: kIo.
  void Flush();
  /// Writes the buffer and closes the file. Error: kIo.
  void Close();

 private:
  std::filesystem::path path_;
  std::string buffer_;
  std::chrono::steady_clock::time_point flushed_ = std::chrono::steady_clock::now();
  int fd_ = -1;
  int error_ = 0;  ///< of the write that failed
};

/// Reports that `path` cannot be created: kIo for a failure of the disk, else kCannotCreate.
[[noreturn]] void FailCreate(const std::string& path, int error_number);
/// Reports an error kIo: `PATH: cannot VERB: REASON`.
[[noreturn]] void FailIo(const std::string& path, const char* verb, int error_number);

}  // namespace alidade::internal
