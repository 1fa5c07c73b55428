// SPDX-License-Identifier: Apache-2.0
//
// A plugin file before anything of it runs: its build tag, and all that the dynamic loader will
// walk. What is accepted must also satisfy a check of its own, made from the bytes alone.
#include <elf.h>

#include <cstring>
#include <map>

#include "alidade/host/elf_file.h"
#include "alidade/host/loadable.h"
#include "alidade/host/plugin_host.h"
#include "fuzz.h"

namespace alidade::fuzz {
namespace {

/// A library, by the offsets of the file.
class Library {
 public:
  explicit Library(std::string_view bytes) : bytes_(bytes), header_(At<Elf64_Ehdr>(0)) {
    for (unsigned i = 0; i < header_.e_phnum; ++i) {
      segments_.push_back(At<Elf64_Phdr>(header_.e_phoff + i * sizeof(Elf64_Phdr)));
    }
  }

  void Check() {
    std::uint64_t end = 0;
    for (const Elf64_Phdr& s : segments_) {
      Require(s.p_offset <= bytes_.size() && s.p_filesz <= bytes_.size() - s.p_offset,
              "a segment that the file does not have");
      if (s.p_type == PT_DYNAMIC) {
        Require(dynamic_ == nullptr, "two dynamic segments");
        dynamic_ = &s;
      }
      if (s.p_type != PT_LOAD) continue;
      Require(s.p_vaddr >= end && s.p_vaddr + s.p_memsz >= s.p_vaddr &&
                  s.p_vaddr + s.p_memsz < std::uint64_t{1} << 47,
              "segments that overlap");
      Require((s.p_vaddr - s.p_offset) % 4096 == 0, "a segment that is not aligned");
      end = s.p_vaddr + s.p_memsz;
    }
    Require(dynamic_ != nullptr && InMemory(dynamic_->p_vaddr, dynamic_->p_filesz, 0),
            "no dynamic segment in memory");
    CheckDynamic();
  }

 private:
  template <class T>
  T At(std::uint64_t offset) const {
    Require(offset <= bytes_.size() && sizeof(T) <= bytes_.size() - offset, "beyond the file");
    T value;
    std::memcpy(&value, bytes_.data() + offset, sizeof value);
    return value;
  }
  bool InMemory(std::uint64_t at, std::uint64_t size, std::uint32_t flags) const {
    for (const Elf64_Phdr& s : segments_) {
      if (s.p_type == PT_LOAD && (s.p_flags & flags) == flags && at >= s.p_vaddr &&
          at - s.p_vaddr <= s.p_memsz && size <= s.p_memsz - (at - s.p_vaddr))
        return true;
    }
    return false;
  }
  /// The offset of what is in memory at an address, with all its bytes in the file.
  std::uint64_t OffsetOf(std::uint64_t at, std::uint64_t size) const {
    for (const Elf64_Phdr& s : segments_) {
      if (s.p_type == PT_LOAD && at >= s.p_vaddr && at - s.p_vaddr <= s.p_filesz &&
          size <= s.p_filesz - (at - s.p_vaddr))
        return s.p_offset + (at - s.p_vaddr);
    }
    Require(false, "a table that the file does not have");
    return 0;
  }

  void CheckDynamic() {
    std::map<std::int64_t, std::uint64_t> tags;
    for (std::uint64_t i = 0;; i += sizeof(Elf64_Dyn)) {
      Require(i + sizeof(Elf64_Dyn) <= dynamic_->p_filesz, "a dynamic table without an end");
      const auto entry = At<Elf64_Dyn>(dynamic_->p_offset + i);
      if (entry.d_tag == DT_NULL) break;
      tags[entry.d_tag] = entry.d_un.d_val;
    }
    const std::uint64_t size = tags[DT_STRSZ];
    Require(size > 0 && bytes_[OffsetOf(tags[DT_STRTAB], size) + size - 1] == '\0',
            "texts without an end");
    for (const auto& [table, length] : {std::pair(DT_RELA, DT_RELASZ), {DT_JMPREL, DT_PLTRELSZ}}) {
      if (!tags.contains(table)) continue;
      const std::uint64_t from = OffsetOf(tags[table], tags[length]);
      for (std::uint64_t i = 0; i < tags[length]; i += sizeof(Elf64_Rela)) {
        const auto relocation = At<Elf64_Rela>(from + i);
        Require(InMemory(relocation.r_offset, 8, PF_W), "a relocation of what cannot be written");
        const std::uint64_t symbol = ELF64_R_SYM(relocation.r_info);
        static_cast<void>(
            OffsetOf(tags[DT_SYMTAB] + symbol * sizeof(Elf64_Sym), sizeof(Elf64_Sym)));
      }
    }
    for (const auto tag : {DT_INIT, DT_FINI}) {
      Require(!tags.contains(tag) || InMemory(tags[tag], 1, PF_X), "a function that is no code");
    }
  }

  std::string_view bytes_;
  Elf64_Ehdr header_;
  std::vector<Elf64_Phdr> segments_;
  const Elf64_Phdr* dynamic_ = nullptr;
};

}  // namespace
}  // namespace alidade::fuzz

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace alidade::fuzz;
  const std::string_view bytes = TextOf(data, size);
  const MemoryFile file(bytes);
  static_cast<void>(Accepts([&] { static_cast<void>(alidade::ReadBuildTag(file.path())); }));
  const bool loadable = Accepts([&] {
    const alidade::internal::ElfFile elf(file.path());
    alidade::internal::CheckLoadable(elf);
  });
  if (loadable) Library(bytes).Check();
  return 0;
}
