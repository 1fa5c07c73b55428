// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <filesystem>
#include <string>
#include <string_view>

#include "alidade/base/error.h"

namespace alidade::internal {

/// File that is written sequentially and reports every write error. Write() appends to a buffer. It
/// flushes the buffer if the buffer is full or the last flush is at least `max_delay` old.
class OutputFile {
 public:
  enum class Mode { kReplace, kAppend };

  static constexpr std::chrono::milliseconds kMaxDelay{1000};

  /// Creates `file`, or opens an existing file. Errors: kCannotCreate, kIo.
  explicit OutputFile(std::filesystem::path file, Mode mode = Mode::kReplace,
                      std::chrono::milliseconds max_delay = kMaxDelay);
  /// Closes the file if Close() was not called. Does not report errors.
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
  std::chrono::milliseconds max_delay_;
  std::chrono::steady_clock::time_point flushed_ = std::chrono::steady_clock::now();
  int fd_ = -1;
  int error_ = 0;  ///< errno of the write that failed
};

/// Throws the Error that `path` cannot be created. The code is kIo if the disk is full or failed,
/// otherwise kCannotCreate.
[[noreturn]] void FailCreate(const std::string& path, int error_number);
/// Throws an Error kIo with the text `PATH: cannot VERB: REASON`.
[[noreturn]] void FailIo(const std::string& path, const char* verb, int error_number);

}  // namespace alidade::internal
