// SPDX-License-Identifier: Apache-2.0
#include "alidade/io/read_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>

namespace alidade::internal {

std::string ReadFile(const std::filesystem::path& file, const ReadFailure& fail,
                     std::size_t max_size, const BeginningCheck& check) {
  struct OpenFile {
    int descriptor;
    ~OpenFile() {
      if (descriptor >= 0) ::close(descriptor);
    }
  };
  const OpenFile open_file{::open(file.c_str(), O_RDONLY | O_CLOEXEC)};
  struct stat status {};
  int error = 0;
  if (open_file.descriptor < 0 || ::fstat(open_file.descriptor, &status) != 0) {
    error = errno;
  } else if (S_ISDIR(status.st_mode)) {
    error = EISDIR;
  }
  if (error == 0) return ReadDescriptor(open_file.descriptor, fail, max_size, check);
  fail(ExitCode::kInputMissing, error);
  return {};
}

std::string ReadDescriptor(int descriptor, const ReadFailure& fail, std::size_t max_size,
                           const BeginningCheck& check) {
  std::string bytes;
  for (char chunk[1 << 14]; bytes.size() < max_size;) {
    const ssize_t count =
        ::read(descriptor, chunk, std::min(sizeof chunk, max_size - bytes.size()));
    if (count < 0) fail(ExitCode::kIo, errno);
    if (count <= 0) break;
    if (bytes.empty() && check) check({chunk, static_cast<std::size_t>(count)});
    bytes.append(chunk, static_cast<std::size_t>(count));
  }
  return bytes;
}

}  // namespace alidade::internal
