// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "alidade/base/error.h"

namespace alidade {

/// The lines of a file, pipe or standard input, one at a time, in constant memory.
///
/// A byte order mark and carriage returns before line feeds are dropped. Errors: kBadData for a
/// line longer than kMaxLine, kIo for a read that fails or a regular file that changed meanwhile,
/// kStopped where a signal ends the wait for more.
class LineReader {
 public:
  static constexpr std::size_t kMaxLine = 4096;  ///< bytes, without the line end

  /// Opens `path`, or standard input where it is `-`; waits where it is a pipe without a writer.
  /// Errors: kInputMissing at `place` and `key`.
  LineReader(const std::filesystem::path& path, const Place& place, const std::string& key)
      : standard_input_(path == "-"), name_(standard_input_ ? "<stdin>" : path.string()) {
    const auto fail = [&](const char* reason) {
      const std::string what = '\'' + name_ + "': " + reason;
      throw Error(ExitCode::kInputMissing, ErrorLine(place, key, what, "a readable file"));
    };
    descriptor_ = standard_input_ ? STDIN_FILENO : open(path.c_str(), O_RDONLY | O_CLOEXEC);
    if (descriptor_ < 0 && errno == EINTR) FailStopped();
    if (descriptor_ < 0) fail(std::strerror(errno));
    const bool known = fstat(descriptor_, &opened_) == 0;
    if (!known || S_ISDIR(opened_.st_mode)) {
      const int reason = known ? EISDIR : errno;
      Close();
      fail(std::strerror(reason));
    }
    if (regular()) start_ = lseek(descriptor_, 0, SEEK_CUR);
  }
  ~LineReader() { Close(); }
  LineReader(const LineReader&) = delete;
  LineReader& operator=(const LineReader&) = delete;

  const std::string& name() const { return name_; }
  /// Of the line that Next() gave last.
  int number() const { return number_; }
  /// No line feed ends the line that Next() gave last.
  bool unterminated() const { return unterminated_; }
  /// It can be read twice; not a pipe.
  bool regular() const { return S_ISREG(opened_.st_mode); }

  /// The next line, which lives until the next call; false at the end.
  bool Next(std::string_view& line) {
    std::size_t scanned = 0;
    for (;;) {
      const char* first = buffer_.data() + begin_;
      const void* feed = std::memchr(first + scanned, '\n', end_ - begin_ - scanned);
      scanned =
          feed ? static_cast<std::size_t>(static_cast<const char*>(feed) - first) : end_ - begin_;
      if (feed != nullptr || scanned > kLongest) return Take(scanned, feed == nullptr, line);
      if (!Fill()) return scanned > 0 && Take(scanned, true, line);
    }
  }

  /// Back to the start of a regular file.
  void Rewind() {
    if (lseek(descriptor_, start_, SEEK_SET) < 0) FailIo(std::strerror(errno));
    begin_ = end_ = 0;
    number_ = 0;
    unterminated_ = false;
  }

 private:
  static constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  static constexpr std::size_t kLongest = kMaxLine + kByteOrderMark.size() + 1;  // 1: '\r'

  bool Take(std::size_t length, bool unterminated, std::string_view& line) {
    line = std::string_view(buffer_.data() + begin_, length);
    begin_ += length + (unterminated ? 0 : 1);
    unterminated_ = unterminated;
    if (++number_ == 1 && line.starts_with(kByteOrderMark))
      line.remove_prefix(kByteOrderMark.size());
    if (line.ends_with('\r')) line.remove_suffix(1);
    if (line.size() <= kMaxLine) return true;
    throw Error(ExitCode::kBadData,
                ErrorLine(Place{name_, number_, 1}, {}, "line too long",
                          "at most " + std::to_string(kMaxLine) + " bytes a line"));
  }

  /// Reads on behind what is left of the buffer; false at the end of the file.
  bool Fill() {
    std::memmove(buffer_.data(), buffer_.data() + begin_, end_ - begin_);
    end_ -= begin_;
    begin_ = 0;
    const ssize_t count = read(descriptor_, buffer_.data() + end_, buffer_.size() - end_);
    if (count < 0 && errno == EINTR) FailStopped();
    if (count < 0) FailIo(std::strerror(errno));
    if (count == 0) CheckUnchanged();
    end_ += static_cast<std::size_t>(count);
    return count > 0;
  }

  void CheckUnchanged() const {
    struct stat now {};
    if (!regular() || fstat(descriptor_, &now) != 0) return;
    const bool same = now.st_size == opened_.st_size &&
                      now.st_mtim.tv_sec == opened_.st_mtim.tv_sec &&
                      now.st_mtim.tv_nsec == opened_.st_mtim.tv_nsec;
    if (!same) FailIo("changed while it was read");
  }

  [[noreturn]] void FailIo(const char* what) const {
    throw Error(ExitCode::kIo, ErrorLine(Place{name_, number_, 0}, {}, what));
  }
  [[noreturn]] void FailStopped() const {
    throw Error(ExitCode::kStopped, ErrorLine(Place{name_, number_, 0}, {},
                                              "stopped by a signal while waiting for data"));
  }
  void Close() {
    if (descriptor_ >= 0 && !standard_input_) close(descriptor_);
  }

  bool standard_input_;
  std::string name_;
  int descriptor_ = -1;
  struct stat opened_ {};
  off_t start_ = 0;
  std::vector<char> buffer_ = std::vector<char>(1 << 16);
  std::size_t begin_ = 0, end_ = 0;  ///< what of the buffer is not yet given out
  int number_ = 0;
  bool unterminated_ = false;
};

}  // namespace alidade
