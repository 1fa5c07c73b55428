// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

#include "alidade/base/error.h"

/// Helpers of all fuzz targets. Each target is one file with LLVMFuzzerTestOneInput; see README.md.
namespace alidade::fuzz {

/// Aborts the program if a property does not hold. The fuzzer then stores the input.
inline void Require(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "fuzz: %s\n", what);
  std::abort();
}

/// Returns true if `work` ends without an Error, and false if `work` throws an Error. Any other
/// exception, and an Error that is marked as internal, crashes the program.
template <class Work>
bool Accepts(const Work& work) {
  try {
    work();
    return true;
  } catch (const Error& error) {
    Require(error.code() != ExitCode::kInternal, error.what());
    return false;
  }
}

inline std::string_view TextOf(const std::uint8_t* data, std::size_t size) {
  return {reinterpret_cast<const char*>(data), size};
}

/// Splits the input at its first `count` - 1 zero bytes. Missing parts are empty.
inline std::vector<std::string> Parts(std::string_view input, std::size_t count) {
  std::vector<std::string> parts(count);
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t end = i + 1 < count ? std::min(input.find('\0'), input.size()) : input.size();
    parts[i] = input.substr(0, end);
    input.remove_prefix(std::min(end + 1, input.size()));
  }
  return parts;
}

/// A file in memory that has a path, for readers that need a path.
class MemoryFile {
 public:
  explicit MemoryFile(std::string_view bytes) : file_(::memfd_create("fuzz", MFD_CLOEXEC)) {
    const bool written =
        ::write(file_, bytes.data(), bytes.size()) == static_cast<ssize_t>(bytes.size());
    Require(written, "cannot write a file in memory");
  }
  ~MemoryFile() { ::close(file_); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  std::filesystem::path path() const { return "/proc/self/fd/" + std::to_string(file_); }

 private:
  int file_;
};

/// A temporary folder that exists as long as the process.
class Folder {
 public:
  /// Creates the folder in a file system in memory, if the machine has one.
  Folder()
      : Folder(::access(kMemory, W_OK) == 0 ? kMemory : std::filesystem::temp_directory_path()) {}
  explicit Folder(const std::filesystem::path& where) {
    std::string name = (where / "fuzzXXXXXX").string();
    Require(::mkdtemp(name.data()) != nullptr, "cannot create a temporary folder");
    path_ = name;
  }
  ~Folder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;

  const std::filesystem::path& path() const { return path_; }
  /// Replaces a file. If `bytes` is empty, the file is removed.
  void Put(const std::string& name, std::string_view bytes) const {
    const std::filesystem::path file = path_ / name;
    std::filesystem::remove(file);
    if (bytes.empty()) return;
    std::filesystem::create_directories(file.parent_path());
    std::ofstream(file, std::ios::binary) << bytes;
  }

 private:
  static constexpr const char* kMemory = "/dev/shm";
  std::filesystem::path path_;
};

}  // namespace alidade::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);
