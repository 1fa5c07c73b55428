// SPDX-License-Identifier: Apache-2.0
#include <elf.h>

#include <cstring>
#include <fstream>
#include <vector>

#include "alidade/host/cpp_plugin.h"
#include "alidade/host/plugin_file.h"
#include "alidade/host/plugin_host.h"

namespace alidade {
namespace fs = std::filesystem;
namespace {

using internal::Refuse;

#if defined(__x86_64__)
constexpr Elf64_Half kMachine = EM_X86_64;
#elif defined(__aarch64__)
constexpr Elf64_Half kMachine = EM_AARCH64;
#else
#error "alidade does not know the ELF machine of this target"
#endif

/// An ELF file read piece by piece; a piece that is not all inside the file is refused.
class ElfFile {
 public:
  explicit ElfFile(const fs::path& path) : path_(path), stream_(path, std::ios::binary) {
    std::error_code error;
    if (!fs::is_regular_file(path, error) || !stream_) Refuse(path, "cannot be read as a file");
    size_ = static_cast<std::uint64_t>(fs::file_size(path, error));
    if (error) Refuse(path, error.message());
  }

  void Require(std::uint64_t offset, std::uint64_t count, const char* what) const {
    if (offset <= size_ && count <= size_ - offset) return;
    Refuse(path_, std::string("truncated: its ") + what + " should reach byte " +
                      (count > UINT64_MAX - offset ? "2^64" : std::to_string(offset + count)) +
                      ", the file ends at " + std::to_string(size_));
  }
  template <class T>
  T Read(std::uint64_t offset, const char* what, std::uint64_t count = sizeof(T)) {
    Require(offset, count, what);
    T value{};
    stream_.clear();
    stream_.seekg(static_cast<std::streamoff>(offset));
    stream_.read(reinterpret_cast<char*>(&value), static_cast<std::streamsize>(count));
    if (!stream_) Refuse(path_, std::string("its ") + what + " cannot be read");
    return value;
  }
  std::uint64_t size() const { return size_; }
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
  std::ifstream stream_;
  std::uint64_t size_ = 0;
};

Elf64_Ehdr ReadHeader(ElfFile& file) {
  const std::uint64_t present = std::min<std::uint64_t>(file.size(), EI_NIDENT);
  const auto ident = file.Read<std::array<unsigned char, EI_NIDENT>>(0, "header", present);
  if (std::memcmp(ident.data(), ELFMAG, SELFMAG) != 0) Refuse(file.path(), "not an ELF file");
  const auto header = file.Read<Elf64_Ehdr>(0, "header");
  if (ident[EI_CLASS] != ELFCLASS64 || ident[EI_DATA] != ELFDATA2LSB ||
      header.e_machine != kMachine) {
    Refuse(file.path(), "an ELF file for another kind of processor");
  }
  if (header.e_type != ET_DYN) Refuse(file.path(), "an ELF file, but not a shared library");
  return header;
}

void CheckSegments(ElfFile& file, const Elf64_Ehdr& header) {
  if (header.e_phnum == 0 || header.e_phentsize != sizeof(Elf64_Phdr)) {
    Refuse(file.path(), "malformed: no table of segments");
  }
  file.Require(header.e_phoff, 0, "table of segments");
  for (std::uint64_t i = 0; i < header.e_phnum; ++i) {
    const std::uint64_t at = header.e_phoff + i * sizeof(Elf64_Phdr);
    const auto segment = file.Read<Elf64_Phdr>(at, "table of segments");
    file.Require(segment.p_offset, segment.p_filesz, "segments");
    if (segment.p_type == PT_LOAD && segment.p_memsz < segment.p_filesz) {
      Refuse(file.path(), "malformed: a segment is larger in the file than in memory");
    }
  }
}

bool HasName(ElfFile& file, const Elf64_Shdr& names, const Elf64_Shdr& section) {
  constexpr char kName[] = ALIDADE_BUILD_TAG_SECTION;
  using Name = std::array<char, sizeof(kName)>;
  if (section.sh_name > names.sh_size || names.sh_size - section.sh_name < sizeof(kName)) {
    return false;
  }
  const auto name = file.Read<Name>(names.sh_offset + section.sh_name, "section names");
  return std::memcmp(name.data(), kName, sizeof(kName)) == 0;
}

Elf64_Shdr FindSection(ElfFile& file, const Elf64_Ehdr& header) {
  const char* const none =
      "has no alidade build tag: not an alidade plugin, or built without "
      "ALIDADE_PLUGIN, or stripped of its section headers";
  if (header.e_shoff == 0 || header.e_shnum == 0) Refuse(file.path(), none);
  if (header.e_shentsize != sizeof(Elf64_Shdr) || header.e_shstrndx >= header.e_shnum) {
    Refuse(file.path(), "malformed: its table of sections");
  }
  file.Require(header.e_shoff, 0, "table of sections");
  const auto section = [&](std::uint64_t i) {
    return file.Read<Elf64_Shdr>(header.e_shoff + i * sizeof(Elf64_Shdr), "table of sections");
  };
  const Elf64_Shdr names = section(header.e_shstrndx);
  file.Require(names.sh_offset, names.sh_size, "section names");
  for (std::uint64_t i = 0; i < header.e_shnum; ++i) {
    const Elf64_Shdr candidate = section(i);
    if (candidate.sh_type == SHT_PROGBITS && HasName(file, names, candidate)) return candidate;
  }
  Refuse(file.path(), none);
}

std::string Version(unsigned major, unsigned minor) {
  return std::to_string(major) + '.' + std::to_string(minor);
}

bool ProcessorHas(std::uint32_t isa) {
#if defined(__x86_64__)
  __builtin_cpu_init();
  switch (isa) {
    case ALIDADE_ISA_AVX:
      return __builtin_cpu_supports("avx") != 0;
    case ALIDADE_ISA_AVX2:
      return __builtin_cpu_supports("avx2") != 0;
    case ALIDADE_ISA_FMA:
      return __builtin_cpu_supports("fma") != 0;
    case ALIDADE_ISA_AVX512F:
      return __builtin_cpu_supports("avx512f") != 0;
    default:
      return false;
  }
#else
  return isa == 0;
#endif
}

std::string IsaName(std::uint32_t isa) {
  if (isa == ALIDADE_ISA_AVX) return "AVX";
  if (isa == ALIDADE_ISA_AVX2) return "AVX2";
  if (isa == ALIDADE_ISA_FMA) return "FMA";
  if (isa == ALIDADE_ISA_AVX512F) return "AVX-512F";
  return "unknown to this version, bit " + std::to_string(isa);
}

}  // namespace

AlidadeBuildTag ReadBuildTag(const fs::path& path) {
  ElfFile file(path);
  const Elf64_Ehdr header = ReadHeader(file);
  CheckSegments(file, header);
  const Elf64_Shdr section = FindSection(file, header);
  const std::uint64_t size = std::min<std::uint64_t>(section.sh_size, sizeof(AlidadeBuildTag));
  auto print = file.Read<AlidadeBuildTag>(section.sh_offset, "build tag", size);
  constexpr std::uint32_t kFixed = offsetof(AlidadeBuildTag, kind);
  if (size < kFixed || std::memcmp(print.magic, "ALIDADE", sizeof(print.magic)) != 0) {
    Refuse(path, "malformed build tag");
  }
  if (print.abi_major != ALIDADE_ABI_MAJOR) {
    Refuse(path, "built for plugin ABI " + Version(print.abi_major, print.abi_minor) +
                     ", this program has " + Version(ALIDADE_ABI_MAJOR, ALIDADE_ABI_MINOR) +
                     "; rebuild the plugin against this version");
  }
  constexpr std::uint32_t kNeeded = offsetof(AlidadeBuildTag, reserved);
  if (print.struct_size < kNeeded || size < kNeeded ||
      (print.kind != ALIDADE_PLUGIN_C_ABI && print.kind != ALIDADE_PLUGIN_CPP)) {
    Refuse(path, "malformed build tag");
  }
  print.compiler[sizeof(print.compiler) - 1] = '\0';
  print.build[sizeof(print.build) - 1] = '\0';
  return print;
}

namespace internal {

const char* HostBuildId() { return ALIDADE_BUILD_ID; }

void CheckBuild(const AlidadeBuildTag& build_tag, const fs::path& file) {
  if ((build_tag.flags & ALIDADE_BUILT_FAST_MATH) != 0) {
    Refuse(file,
           "built with -ffast-math, which makes NaN and infinity undetectable; build it without");
  }
  for (std::uint32_t bit = 1; bit != 0; bit <<= 1) {
    if ((build_tag.isa & bit) != 0 && !ProcessorHas(bit)) {
      Refuse(file, "needs an instruction set that this processor lacks (" + IsaName(bit) +
                       "); build it without -march");
    }
  }
  if (build_tag.kind == ALIDADE_PLUGIN_CPP && std::strcmp(build_tag.build, HostBuildId()) != 0) {
    Refuse(file, std::string("of another build than this program: '") + build_tag.build +
                     "'; expected '" + HostBuildId() + "'");
  }
}

}  // namespace internal
}  // namespace alidade
