// SPDX-License-Identifier: Apache-2.0
#include "alidade/host/elf_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include "alidade/host/plugin_file.h"

namespace alidade::internal {
namespace {

#if defined(__x86_64__)
constexpr Elf64_Half kMachine = EM_X86_64;
#elif defined(__aarch64__)
constexpr Elf64_Half kMachine = EM_AARCH64;
#else
#error "alidade does not know the ELF machine of this target"
#endif

}  // namespace

ElfFile::ElfFile(const std::filesystem::path& path) : path_(path) {
  // A pipe that nobody writes to would be waited for.
  file_ = open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  struct stat status {};
  if (file_ < 0) RefuseAs(std::string("cannot be read as a file: ") + std::strerror(errno));
  if (fstat(file_, &status) != 0 || !S_ISREG(status.st_mode)) {
    close(file_);
    RefuseAs("cannot be read as a file");
  }
  size_ = static_cast<std::uint64_t>(status.st_size);
  try {
    std::array<unsigned char, EI_NIDENT> ident{};
    const std::uint64_t present = std::min<std::uint64_t>(size_, EI_NIDENT);
    std::ranges::copy(Read<unsigned char>(0, present, "header"), ident.begin());
    if (std::memcmp(ident.data(), ELFMAG, SELFMAG) != 0) RefuseAs("not an ELF file");
    header_ = Read<Elf64_Ehdr>(0, 1, "header").front();
    if (ident[EI_CLASS] != ELFCLASS64 || ident[EI_DATA] != ELFDATA2LSB ||
        header_.e_machine != kMachine) {
      RefuseAs("an ELF file for another kind of processor");
    }
    if (header_.e_type != ET_DYN) RefuseAs("an ELF file, but not a shared library");
    if (header_.e_phnum == 0 || header_.e_phentsize != sizeof(Elf64_Phdr)) {
      RefuseAs("malformed: no table of segments");
    }
    segments_ = Read<Elf64_Phdr>(header_.e_phoff, header_.e_phnum, "table of segments");
    for (const Elf64_Phdr& segment : segments_) {
      Require(segment.p_offset, segment.p_filesz, 1, "segments");
    }
  } catch (...) {
    close(file_);
    throw;
  }
}

ElfFile::~ElfFile() { close(file_); }

void ElfFile::RefuseAs(const std::string& why) const { Refuse(path_, why); }

void ElfFile::Require(std::uint64_t offset, std::uint64_t count, std::uint64_t size,
                      const char* what) const {
  if (offset <= size_ && count <= (size_ - offset) / size) return;
  const bool huge = count > (UINT64_MAX - offset) / size;
  RefuseAs(std::string("truncated: its ") + what + " should reach byte " +
           (huge ? "2^64" : std::to_string(offset + count * size)) + ", the file ends at " +
           std::to_string(size_));
}

void ElfFile::ReadBytes(std::uint64_t offset, void* to, std::size_t size, const char* what) const {
  auto* at = static_cast<char*>(to);
  while (size > 0) {
    const ssize_t read = pread(file_, at, size, static_cast<off_t>(offset));
    if (read < 0 && errno == EINTR) continue;
    if (read <= 0) RefuseAs(std::string("its ") + what + " cannot be read");
    at += read;
    offset += static_cast<std::uint64_t>(read);
    size -= static_cast<std::size_t>(read);
  }
}

std::optional<Elf64_Shdr> ElfFile::FindSection(const std::string& name) const {
  if (header_.e_shoff == 0 || header_.e_shnum == 0) return std::nullopt;
  if (header_.e_shentsize != sizeof(Elf64_Shdr) || header_.e_shstrndx >= header_.e_shnum) {
    RefuseAs("malformed: its table of sections");
  }
  const auto sections = Read<Elf64_Shdr>(header_.e_shoff, header_.e_shnum, "table of sections");
  const Elf64_Shdr& names = sections[header_.e_shstrndx];
  const auto texts = Read<char>(names.sh_offset, names.sh_size, "section names");
  for (const Elf64_Shdr& section : sections) {
    if (section.sh_type != SHT_PROGBITS || section.sh_name > texts.size() ||
        texts.size() - section.sh_name < name.size() + 1) {
      continue;
    }
    if (std::memcmp(texts.data() + section.sh_name, name.c_str(), name.size() + 1) == 0) {
      return section;
    }
  }
  return std::nullopt;
}

}  // namespace alidade::internal
