// SPDX-License-Identifier: Apache-2.0
#include "alidade/plugin/plugin_sections.h"

#include <elf.h>

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <fstream>
#include <vector>

#include "alidade/plugin/abi_read.h"

namespace alidade {
namespace fs = std::filesystem;
namespace {

using internal::Refuse;

#if defined(__aarch64__)
constexpr Elf64_Half kMachine = EM_AARCH64;
#else
constexpr Elf64_Half kMachine = EM_X86_64;
#endif
constexpr std::uint64_t kMaxBytes = 1 << 20;  // maximum size of one read

/// Reads `count` values of T at `offset`. Returns an empty vector if the file is shorter.
template <class T>
std::vector<T> ReadAt(std::istream& file, std::uint64_t offset, std::uint64_t count) {
  std::vector<T> values(count <= kMaxBytes / sizeof(T) ? count : 0);
  const auto size = static_cast<std::streamsize>(values.size() * sizeof(T));
  file.seekg(static_cast<std::streamoff>(offset));
  if (!file.read(reinterpret_cast<char*>(values.data()), size)) values.clear();
  return values;
}

/// Reads a section of an ELF file for this kind of processor, without loading the file as a
/// library. Returns an empty vector if the file or section does not exist.
std::vector<char> ReadSection(const fs::path& path, const std::string& name) {
  std::error_code error;
  if (!fs::is_regular_file(path, error)) return {};  // reading a pipe would block
  std::ifstream file(path, std::ios::binary);
  const auto header = ReadAt<Elf64_Ehdr>(file, 0, 1);
  if (header.empty() || std::memcmp(header[0].e_ident, ELFMAG, SELFMAG) != 0 ||
      header[0].e_ident[EI_CLASS] != ELFCLASS64 || header[0].e_machine != kMachine ||
      header[0].e_shentsize != sizeof(Elf64_Shdr)) {
    return {};
  }
  const auto sections = ReadAt<Elf64_Shdr>(file, header[0].e_shoff, header[0].e_shnum);
  if (header[0].e_shstrndx >= sections.size()) return {};
  const Elf64_Shdr& names = sections[header[0].e_shstrndx];
  std::vector<char> texts = ReadAt<char>(file, names.sh_offset, names.sh_size);
  texts.push_back('\0');
  for (const Elf64_Shdr& section : sections) {
    if (section.sh_name < texts.size() && name == &texts[section.sh_name]) {
      return ReadAt<char>(file, section.sh_offset, section.sh_size);
    }
  }
  return {};
}

std::string Version(unsigned major, unsigned minor) {
  return std::to_string(major) + '.' + std::to_string(minor);
}

}  // namespace

AlidadeBuildTag ReadBuildTag(const fs::path& path) {
  const std::vector<char> bytes = ReadSection(path, ALIDADE_BUILD_TAG_SECTION);
  if (bytes.empty()) {
    Refuse(
        path,
        "has no alidade build tag: it is not an alidade plugin, is for another kind of processor, "
        "is damaged, was built without the macro ALIDADE_PLUGIN, or has no section headers");
  }
  AlidadeBuildTag tag{};
  std::memcpy(&tag, bytes.data(), std::min(bytes.size(), sizeof(tag)));
  constexpr std::size_t kVersioned = offsetof(AlidadeBuildTag, kind);
  if (bytes.size() < kVersioned || std::memcmp(tag.magic, "ALIDADE", sizeof(tag.magic)) != 0) {
    Refuse(path, "has a malformed build tag");
  }
  if (tag.abi_major != ALIDADE_ABI_MAJOR) {
    Refuse(path, "was built for plugin ABI " + Version(tag.abi_major, tag.abi_minor) +
                     ", but this program has " + Version(ALIDADE_ABI_MAJOR, ALIDADE_ABI_MINOR) +
                     "; rebuild the plugin against this version");
  }
  constexpr std::size_t kNeeded = offsetof(AlidadeBuildTag, reserved);
  if (tag.struct_size < kNeeded || bytes.size() < kNeeded ||
      (tag.kind != ALIDADE_PLUGIN_C_ABI && tag.kind != ALIDADE_PLUGIN_CPP)) {
    Refuse(path, "has a malformed build tag");
  }
  if (tag.needs_minor > ALIDADE_ABI_MINOR) {
    Refuse(path, "needs plugin ABI " + Version(tag.abi_major, tag.needs_minor) +
                     ", but this program has " + Version(ALIDADE_ABI_MAJOR, ALIDADE_ABI_MINOR) +
                     "; use a later version of alidade");
  }
  const std::string unknown =
      internal::UnknownBits(tag.flags, ALIDADE_BUILT_FAST_MATH | ALIDADE_BUILT_DEBUG_STL);
  if (!unknown.empty()) {
    Refuse(path, "its build tag has flags that this version does not know: " + unknown);
  }
  if (tag.reserved0 != 0 || !internal::AllZero(tag.reserved)) {
    Refuse(path, "its build tag uses reserved members");
  }
  tag.compiler[sizeof(tag.compiler) - 1] = '\0';
  tag.build[sizeof(tag.build) - 1] = '\0';
  return tag;
}

bool internal::MayOffer(const fs::path& path, const std::set<std::string>& names) {
  const std::vector<char> text = ReadSection(path, ALIDADE_NAMES_SECTION);
  if (text.empty() || text.back() != '\0') return true;
  for (auto name = text.begin(); name != text.end();) {
    const auto end = std::find(name, text.end(), '\0');
    if (names.contains(std::string(name, end))) return true;
    name = end + 1;
  }
  return false;
}

}  // namespace alidade
