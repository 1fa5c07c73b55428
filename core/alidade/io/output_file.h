// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <filesystem>
#include <string>
#include <string_view>

#include "alidade/base/error.h"

namespace alidade::internal {

/// File that is written sequentially and reports every write error. A text is buffered. A later
/// Write() flushes the buffer if it is a second old.
class OutputFile {
 public:
  enum class Mode { kReplace, kAppend };

  /// Creates `file`, or opens one that exists. Errors: kCannotCreate, kIo.
  explicit OutputFile(std::filesystem::path file, Mode mode = Mode::kReplace);
  /// Closes the file without reporting errors, unless Close() was called.
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// Appends a text. Error: kIo. After an error the file accepts no further text, and may end in
  /// the middle of a text.
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
  int error_ = 0;  ///< errno of the write that failed
};

/// Throws an Error because `path` cannot be created: kIo if the disk is full or failed, else
/// kCannotCreate.
[[noreturn]] void FailCreate(const std::string& path, int error_number);
/// Throws an Error kIo with the text `PATH: cannot VERB: REASON`.
[[noreturn]] void FailIo(const std::string& path, const char* verb, int error_number);

}  // namespace alidade::internal
