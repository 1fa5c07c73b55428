// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <elf.h>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace alidade::internal {

/// A file read piece by piece, as a shared library for this kind of processor. A piece that is not
/// all inside the file is refused. Nothing of it is run. Errors: kPlugin.
class ElfFile {
 public:
  /// Refuses what is no regular file (a pipe is not waited for), or no shared library.
  explicit ElfFile(const std::filesystem::path& path);
  ~ElfFile();
  ElfFile(const ElfFile&) = delete;
  ElfFile& operator=(const ElfFile&) = delete;

  const std::vector<Elf64_Phdr>& segments() const { return segments_; }

  /// `count` values of T from `offset` on. `what` is how messages name them.
  template <class T>
  std::vector<T> Read(std::uint64_t offset, std::uint64_t count, const char* what) const {
    Require(offset, count, sizeof(T), what);
    std::vector<T> values(static_cast<std::size_t>(count));
    ReadBytes(offset, values.data(), values.size() * sizeof(T), what);
    return values;
  }
  /// The first section of that name that has bytes in the file.
  std::optional<Elf64_Shdr> FindSection(const std::string& name) const;
  [[noreturn]] void RefuseAs(const std::string& why) const;

 private:
  void Require(std::uint64_t offset, std::uint64_t count, std::uint64_t size,
               const char* what) const;
  void ReadBytes(std::uint64_t offset, void* to, std::size_t size, const char* what) const;

  std::filesystem::path path_;
  int file_ = -1;
  std::uint64_t size_ = 0;
  Elf64_Ehdr header_{};
  std::vector<Elf64_Phdr> segments_;
};

}  // namespace alidade::internal
