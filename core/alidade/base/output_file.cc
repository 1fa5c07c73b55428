// SPDX-License-Identifier: Apache-2.0
#include "alidade/base/output_file.h"

#include <fcntl.h>
#include <signal.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <system_error>

namespace alidade::internal {
namespace {

constexpr std::size_t kBufferSize = 1 << 16;
constexpr std::chrono::seconds kLongestWait{1};

/// write(2) that answers EFBIG where the file size is limited, without the signal that would end
/// the process.
ssize_t WriteQuietly(int fd, const char* data, std::size_t size) {
  sigset_t limit, before;
  sigemptyset(&limit);
  sigaddset(&limit, SIGXFSZ);
  pthread_sigmask(SIG_BLOCK, &limit, &before);
  const ssize_t written = ::write(fd, data, size);
  const int error = errno;
  if (written < 0 && error == EFBIG && sigismember(&before, SIGXFSZ) == 0) {
    const timespec now{};
    sigtimedwait(&limit, nullptr, &now);
  }
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  errno = error;
  return written;
}

std::string Reason(int error_number) { return std::generic_category().message(error_number); }

}  // namespace

void FailCreate(const std::string& path, int error_number) {
  const bool disk = error_number == ENOSPC || error_number == EDQUOT || error_number == EIO;
  throw Error(disk ? ExitCode::kIo : ExitCode::kCannotCreate,
              ErrorLine(Place{path}, {}, "cannot create: " + Reason(error_number)));
}

void FailIo(const std::string& path, const char* verb, int error_number) {
  throw Error(
      ExitCode::kIo,
      ErrorLine(Place{path}, {}, std::string("cannot ") + verb + ": " + Reason(error_number)));
}

void Sync(const std::filesystem::path& path, const std::string& shown) {
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) FailIo(shown, "sync", errno);
  const int result = ::fsync(fd);
  const int error = errno;
  ::close(fd);
  // EINVAL: a file system that has nothing to sync.
  if (result != 0 && error != EINVAL) FailIo(shown, "sync", error);
}

OutputFile::OutputFile(const std::filesystem::path& file, std::string shown)
    : shown_(std::move(shown)),
      fd_(::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666)) {
  if (fd_ < 0) FailCreate(shown_, errno);
  buffer_.reserve(kBufferSize);
}

OutputFile::~OutputFile() {
  try {
    if (fd_ >= 0) Flush();
  } catch (const std::exception&) {
    // What fits in is there.
  }
  if (fd_ >= 0) ::close(fd_);
}

void OutputFile::Write(std::string_view text) {
  buffer_ += text;
  ends_.push_back(buffer_.size());
  const bool due = std::chrono::steady_clock::now() - flushed_ >= kLongestWait;
  if (due || buffer_.size() >= kBufferSize) Flush();
}

void OutputFile::Flush() {
  if (fd_ < 0) FailIo(shown_, "write", error_);  // what follows a gap is worth nothing
  std::size_t done = 0;
  while (done < buffer_.size()) {
    const ssize_t written = WriteQuietly(fd_, buffer_.data() + done, buffer_.size() - done);
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) {
      error_ = errno;
      const auto whole = std::ranges::upper_bound(ends_, done);
      const std::uint64_t kept = size_ + (whole == ends_.begin() ? 0 : *(whole - 1));
      static_cast<void>(::ftruncate(fd_, static_cast<off_t>(kept)));
      ::close(fd_);
      fd_ = -1;
      FailIo(shown_, "write", error_);
    }
    done += static_cast<std::size_t>(written);
  }
  size_ += done;
  buffer_.clear();
  ends_.clear();
  flushed_ = std::chrono::steady_clock::now();
}

void OutputFile::Close() {
  Flush();
  const int fd = fd_;
  fd_ = -1;
  if (::close(fd) != 0 && errno != EINTR) FailIo(shown_, "write", errno);
}

}  // namespace alidade::internal
