// SPDX-License-Identifier: Apache-2.0
#include "alidade/io/output_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>
#include <utility>

namespace alidade::internal {
namespace {

constexpr std::size_t kBufferSize = 1 << 16;

std::string Reason(int error_number) { return std::generic_category().message(error_number); }

}  // namespace

void FailCreate(const std::string& path, int error_number) {
  const bool is_disk_error =
      error_number == ENOSPC || error_number == EDQUOT || error_number == EIO;
  throw Error(is_disk_error ? ExitCode::kIo : ExitCode::kCannotCreate,
              ErrorLine(Place{path}, {}, "cannot create: " + Reason(error_number)));
}

void FailIo(const std::string& path, const char* verb, int error_number) {
  throw Error(
      ExitCode::kIo,
      ErrorLine(Place{path}, {}, std::string("cannot ") + verb + ": " + Reason(error_number)));
}

OutputFile::OutputFile(std::filesystem::path file, Mode mode, std::chrono::milliseconds max_delay)
    : path_(std::move(file)), max_delay_(max_delay) {
  const int open_flag = mode == Mode::kAppend ? O_APPEND : O_TRUNC;
  fd_ = ::open(path_.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | open_flag, 0666);
  if (fd_ < 0) FailCreate(path_.string(), errno);
  buffer_.reserve(kBufferSize);
}

OutputFile::~OutputFile() {
  try {
    if (fd_ >= 0) Close();
  } catch (const std::exception&) {  // only an explicit Close() reports errors
  }
}

void OutputFile::Write(std::string_view text) {
  buffer_ += text;
  const bool is_due = std::chrono::steady_clock::now() - flushed_ >= max_delay_;
  if (is_due || buffer_.size() >= kBufferSize) Flush();
}

void OutputFile::Flush() {
  // A write failed. Further rows after the gap would be misleading.
  if (fd_ < 0) FailIo(path_.string(), "write", error_);
  for (std::string_view remaining = buffer_; !remaining.empty();) {
    const ssize_t written = ::write(fd_, remaining.data(), remaining.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) {
      error_ = errno;
      ::close(std::exchange(fd_, -1));
      FailIo(path_.string(), "write", error_);
    }
    remaining.remove_prefix(static_cast<std::size_t>(written));
  }
  buffer_.clear();
  flushed_ = std::chrono::steady_clock::now();
}

void OutputFile::Close() {
  Flush();
  if (::close(std::exchange(fd_, -1)) != 0 && errno != EINTR) {
    FailIo(path_.string(), "write", errno);
  }
}

}  // namespace alidade::internal
