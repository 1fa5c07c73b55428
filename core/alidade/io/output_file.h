// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <filesystem>
#include <string>
#include <string_view>

#include "alidade/base/error.h"

namespace alidade::internal {

/// A file that is written from front to end, every byte checked. What it is given waits for at most
/// a second, as long as more follows, before the operating system has it.
class OutputFile {
 public:
  enum class Mode { kReplace, kAppend };

  /// Creates `file`, or opens one that exists. Errors: kCannotCreate, kIo.
  explicit OutputFile(std::filesystem::path file, Mode mode = Mode::kReplace);
  /// Writes and closes, ignoring errors, unless Close() has.
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// Error: kIo; the file then takes no more, and may end in the middle of a text.
  void Write(std::string_view text);
  /// Gives what is buffered to the operating system now. Error: kIo.
  void Flush();
  /// Writes what is buffered and closes. Error: kIo.
  void Close();

 private:
  std::filesystem::path path_;
  std::string buffer_;
  std::chrono::steady_clock::time_point flushed_ = std::chrono::steady_clock::now();
  int fd_ = -1;
  int error_ = 0;  ///< of the write that failed
};

/// Reports that `path` cannot be created: kIo if the disk is at fault, else kCannotCreate.
[[noreturn]] void FailCreate(const std::string& path, int error_number);
/// Error kIo: `PATH: cannot VERB: REASON`.
[[noreturn]] void FailIo(const std::string& path, const char* verb, int error_number);

}  // namespace alidade::internal
