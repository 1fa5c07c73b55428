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
#include "alidade/io/near_file.h"

namespace alidade {

/// Reader of a file, pipe or standard input. It reads line by line in constant memory.
///
/// It drops a byte order mark, and carriage returns before line feeds. Errors:
///
///   kBadData   a line is longer than kMaxLine
///   kIo        a read failed, or a regular file changed while it was read
///   kStopped   a signal interrupted the wait for data
class LineReader {
 public:
  /// Maximum length of a line in bytes. The line end does not count.
  static constexpr std::size_t kMaxLine = 4096;

  /// Opens `path`, or standard input if `path` is `-`. Blocks on a named pipe until another process
  /// opens the pipe for writing. Error: kInputMissing, whose message contains `place` and `key`.
  LineReader(const std::filesystem::path& path, const Place& place, const std::string& key)
      : is_standard_input_(path == "-"), name_(is_standard_input_ ? "<stdin>" : path.string()) {
    const auto fail = [&](const char* reason) {
      const std::string problem = "cannot read '" + name_ + "': " + reason;
      throw Error(ExitCode::kInputMissing,
                  ErrorLine(place, key, problem, "a readable file", internal::NearFile(path)));
    };
    descriptor_ = is_standard_input_ ? STDIN_FILENO : open(path.c_str(), O_RDONLY | O_CLOEXEC);
    if (descriptor_ < 0 && errno == EINTR) FailStopped();
    if (descriptor_ < 0) fail(std::strerror(errno));
    const bool has_status = fstat(descriptor_, &initial_status_) == 0;
    if (!has_status || S_ISDIR(initial_status_.st_mode)) {
      const int reason = has_status ? EISDIR : errno;
      Close();
      fail(std::strerror(reason));
    }
    if (is_regular()) start_ = lseek(descriptor_, 0, SEEK_CUR);
  }
  ~LineReader() { Close(); }
  LineReader(const LineReader&) = delete;
  LineReader& operator=(const LineReader&) = delete;

  const std::string& name() const { return name_; }
  /// Returns the number of the line that Next() read last.
  int number() const { return number_; }
  /// Returns true if the line that Next() read last does not end in a line feed.
  bool is_unterminated() const { return is_unterminated_; }
  /// Returns true for a regular file, which can be read twice, unlike a pipe.
  bool is_regular() const { return S_ISREG(initial_status_.st_mode); }

  /// Reads the next line into `line`, which is valid until the next call. Returns false at the end
  /// of the file.
  bool Next(std::string_view& line) {
    std::size_t scanned = 0;
    for (;;) {
      const char* first = buffer_.data() + begin_;
      const void* feed = std::memchr(first + scanned, '\n', end_ - begin_ - scanned);
      scanned =
          feed ? static_cast<std::size_t>(static_cast<const char*>(feed) - first) : end_ - begin_;
      if (feed != nullptr || scanned > kMaxBytes)
        return ExtractLine(scanned, feed == nullptr, line);
      if (!Fill()) return scanned > 0 && ExtractLine(scanned, true, line);
    }
  }

  /// Moves back to the start of a regular file.
  void Rewind() {
    if (lseek(descriptor_, start_, SEEK_SET) < 0) FailIo(std::strerror(errno));
    begin_ = end_ = 0;
    number_ = 0;
    is_unterminated_ = false;
  }

 private:
  static constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  // The additional byte is '\r'.
  static constexpr std::size_t kMaxBytes = kMaxLine + kByteOrderMark.size() + 1;

  /// Moves a line of `length` bytes from the buffer to `line`. Returns true.
  bool ExtractLine(std::size_t length, bool is_unterminated, std::string_view& line) {
    line = std::string_view(buffer_.data() + begin_, length);
    begin_ += length + (is_unterminated ? 0 : 1);
    is_unterminated_ = is_unterminated;
    if (++number_ == 1 && line.starts_with(kByteOrderMark))
      line.remove_prefix(kByteOrderMark.size());
    if (line.ends_with('\r')) line.remove_suffix(1);
    if (line.size() <= kMaxLine) return true;
    throw Error(ExitCode::kBadData,
                ErrorLine(Place{name_, number_, 1}, {}, "the line is too long",
                          "at most " + std::to_string(kMaxLine) + " bytes per line"));
  }

  /// Reads more bytes after the unread part of the buffer. Returns false at the end of the file.
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
    struct stat status {};
    if (!is_regular() || fstat(descriptor_, &status) != 0) return;
    const bool is_unchanged = status.st_size == initial_status_.st_size &&
                              status.st_mtim.tv_sec == initial_status_.st_mtim.tv_sec &&
                              status.st_mtim.tv_nsec == initial_status_.st_mtim.tv_nsec;
    if (!is_unchanged) FailIo("the file changed while it was read");
  }

  [[noreturn]] void FailIo(const char* problem) const {
    throw Error(ExitCode::kIo, ErrorLine(Place{name_, number_, 0}, {}, problem));
  }
  [[noreturn]] void FailStopped() const {
    throw Error(ExitCode::kStopped, ErrorLine(Place{name_, number_, 0}, {},
                                              "stopped by a signal while waiting for data"));
  }
  void Close() {
    if (descriptor_ >= 0 && !is_standard_input_) close(descriptor_);
  }

  bool is_standard_input_;
  std::string name_;
  int descriptor_ = -1;
  struct stat initial_status_ {};  ///< status of the file when it was opened
  off_t start_ = 0;
  std::vector<char> buffer_ = std::vector<char>(1 << 16);
  std::size_t begin_ = 0, end_ = 0;  ///< unread part of the buffer
  int number_ = 0;
  bool is_unterminated_ = false;
};

}  // namespace alidade
