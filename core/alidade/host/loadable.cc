// SPDX-License-Identifier: Apache-2.0
//
// What glibc's ld.so reads of a library without a look at whether it can be so: gABI chapter 5
// (program loading, dynamic linking), the GNU hash table and symbol versions.
#include "alidade/host/loadable.h"

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "alidade/host/elf_file.h"

namespace alidade::internal {
namespace {

using Address = std::uint64_t;

constexpr Address kTop = Address{1} << 47;  ///< of user space
constexpr Address kPage = 4096;             ///< the smallest; larger ones only move ends

bool IsPowerOfTwo(std::uint64_t n) { return n != 0 && (n & (n - 1)) == 0; }

#if defined(__x86_64__)
constexpr std::uint32_t kRelative = R_X86_64_RELATIVE, kDescriptor = R_X86_64_TLSDESC,
                        kAbsolute = R_X86_64_64;
const std::set<std::uint32_t> kRelocations = {
    R_X86_64_64,       R_X86_64_GLOB_DAT, R_X86_64_JUMP_SLOT, R_X86_64_RELATIVE, R_X86_64_DTPMOD64,
    R_X86_64_DTPOFF64, R_X86_64_TPOFF64,  R_X86_64_TLSDESC,   R_X86_64_IRELATIVE};
const std::set<std::uint32_t> kToSymbols = {R_X86_64_64, R_X86_64_GLOB_DAT, R_X86_64_JUMP_SLOT};
#else
constexpr std::uint32_t kRelative = R_AARCH64_RELATIVE, kDescriptor = R_AARCH64_TLSDESC,
                        kAbsolute = R_AARCH64_ABS64;
const std::set<std::uint32_t> kRelocations = {
    R_AARCH64_ABS64,     R_AARCH64_GLOB_DAT,   R_AARCH64_JUMP_SLOT,
    R_AARCH64_RELATIVE,  R_AARCH64_TLS_DTPMOD, R_AARCH64_TLS_DTPREL,
    R_AARCH64_TLS_TPREL, R_AARCH64_TLSDESC,    R_AARCH64_IRELATIVE};
const std::set<std::uint32_t> kToSymbols = {R_AARCH64_ABS64, R_AARCH64_GLOB_DAT,
                                            R_AARCH64_JUMP_SLOT};
#endif

/// One library under examination.
class Examination {
 public:
  explicit Examination(const ElfFile& file) : file_(file) {}

  void Run() {
    CheckLoads();
    CheckOthers();
    ReadDynamic();
    CheckTexts();
    CountSymbols();
    CheckSymbols();
    CheckVersions();
    CheckRelocations(DT_RELA, DT_RELASZ);
    CheckRelocations(DT_JMPREL, DT_PLTRELSZ);
    CheckPackedRelocations();
    CheckFunctions();
  }

 private:
  [[noreturn]] void Fail(const std::string& what) const { file_.RefuseAs("malformed: " + what); }

  /// The loaded segment that has [at, at + size) in memory; null: none has.
  const Elf64_Phdr* Holder(Address at, std::uint64_t size, std::uint32_t flags = 0) const {
    for (const Elf64_Phdr* load : loads_) {
      if (at >= load->p_vaddr && at - load->p_vaddr <= load->p_memsz &&
          size <= load->p_memsz - (at - load->p_vaddr) && (load->p_flags & flags) == flags) {
        return load;
      }
    }
    return nullptr;
  }

  /// `count` values of T that lie at an address of memory, and in the file.
  template <class T>
  std::vector<T> ReadAt(Address at, std::uint64_t count, const char* what) const {
    if (count > UINT64_MAX / sizeof(T)) Fail(std::string(what) + " is too large");
    const std::uint64_t size = count * sizeof(T);
    const Elf64_Phdr* const load = Holder(at, size);
    if (load == nullptr || at - load->p_vaddr > load->p_filesz ||
        size > load->p_filesz - (at - load->p_vaddr)) {
      Fail(std::string(what) + " lies outside the segments that are loaded");
    }
    return file_.Read<T>(load->p_offset + (at - load->p_vaddr), count, what);
  }

  void CheckLoads() {
    Address end = 0;
    for (const Elf64_Phdr& segment : file_.segments()) {
      if (segment.p_type != PT_LOAD) continue;
      if (segment.p_memsz < segment.p_filesz) {
        Fail("a segment is larger in the file than in memory");
      }
      if (segment.p_vaddr < end || segment.p_vaddr >= kTop ||
          segment.p_memsz >= kTop - segment.p_vaddr) {
        Fail("its segments overlap, or do not fit into memory");
      }
      const std::uint64_t align = std::max<std::uint64_t>(segment.p_align, kPage);
      if ((segment.p_align > 1 && !IsPowerOfTwo(segment.p_align)) || align >= kTop ||
          (segment.p_vaddr - segment.p_offset) % align != 0) {
        Fail("a segment is not aligned");
      }
      if (segment.p_memsz > segment.p_filesz && (segment.p_flags & PF_W) == 0) {
        Fail("a segment of code or constants is not all in the file");
      }
      end = segment.p_vaddr + segment.p_memsz;
      loads_.push_back(&segment);
    }
    if (loads_.empty()) Fail("nothing of it is loaded");
  }

  /// Segments within those that are loaded.
  void CheckOthers() {
    for (const Elf64_Phdr& segment : file_.segments()) {
      switch (segment.p_type) {
        case PT_DYNAMIC:
          if (dynamic_ != nullptr) Fail("two tables for the dynamic loader");
          dynamic_ = &segment;
          [[fallthrough]];
        case PT_NOTE:
        case PT_GNU_PROPERTY:
        case PT_GNU_EH_FRAME:
        case PT_PHDR:
          CheckWithin(segment, segment.p_memsz);
          break;
        case PT_TLS:
          CheckWithin(segment, segment.p_filesz);
          if (segment.p_memsz < segment.p_filesz || segment.p_memsz >= (Address{1} << 31) ||
              (segment.p_align > 1 &&
               (!IsPowerOfTwo(segment.p_align) || segment.p_align > kPage))) {
            Fail("its thread-local storage");
          }
          break;
        case PT_GNU_RELRO:
          CheckProtected(segment);
          break;
        case PT_GNU_STACK:
          if ((segment.p_flags & PF_X) != 0) Fail("it asks for a stack that can be executed");
          break;
        default:
          break;
      }
    }
    if (dynamic_ == nullptr) Fail("no table for the dynamic loader");
  }

  void CheckWithin(const Elf64_Phdr& segment, std::uint64_t size) const {
    const Elf64_Phdr* const load = Holder(segment.p_vaddr, size);
    if (size > 0 &&
        (load == nullptr || segment.p_vaddr - load->p_vaddr != segment.p_offset - load->p_offset)) {
      Fail("a segment lies outside those that are loaded");
    }
  }

  /// What is made read-only after the relocations ends at a page.
  void CheckProtected(const Elf64_Phdr& segment) const {
    const Elf64_Phdr* const load = Holder(segment.p_vaddr, 0, PF_W);
    if (load == nullptr || segment.p_memsz > kTop ||
        segment.p_vaddr + segment.p_memsz > load->p_vaddr + load->p_memsz + kPage - 1) {
      Fail("what it protects lies outside the segments that are loaded");
    }
  }

  void ReadDynamic() {
    const auto entries = file_.Read<Elf64_Dyn>(
        dynamic_->p_offset, dynamic_->p_filesz / sizeof(Elf64_Dyn), "table for the dynamic loader");
    bool ended = false;
    for (const Elf64_Dyn& entry : entries) {
      ended = entry.d_tag == DT_NULL;
      if (ended) break;
      if (entry.d_tag == DT_NEEDED || entry.d_tag == DT_SONAME || entry.d_tag == DT_RPATH ||
          entry.d_tag == DT_RUNPATH || entry.d_tag == DT_AUXILIARY || entry.d_tag == DT_FILTER) {
        names_.push_back(entry);
      } else if (!tags_.emplace(entry.d_tag, entry.d_un.d_val).second) {
        Fail("its table for the dynamic loader has an entry twice");
      }
    }
    if (!ended || dynamic_->p_memsz < dynamic_->p_filesz) {
      Fail("its table for the dynamic loader has no end");
    }
    if (Tag(DT_TEXTREL) || (Tag(DT_FLAGS).value_or(0) & DF_TEXTREL) != 0) {
      Fail("it has relocations in its code; build it with -fPIC");
    }
    if (Tag(DT_REL)) Fail("relocations of another kind of processor");
  }

  std::optional<std::uint64_t> Tag(std::int64_t tag) const {
    const auto found = tags_.find(tag);
    return found == tags_.end() ? std::nullopt : std::optional(found->second);
  }
  std::uint64_t Need(std::int64_t tag, const char* what) const {
    const std::optional<std::uint64_t> value = Tag(tag);
    if (!value) Fail(std::string("its table for the dynamic loader has no ") + what);
    return *value;
  }

  void CheckTexts() {
    texts_ =
        ReadAt<char>(Need(DT_STRTAB, "texts"), Need(DT_STRSZ, "size of texts"), "table of texts");
    if (texts_.empty() || texts_.back() != '\0') Fail("its table of texts has no end");
    for (const Elf64_Dyn& name : names_) {
      CheckText(name.d_un.d_val);
      const bool library =
          name.d_tag == DT_NEEDED || name.d_tag == DT_AUXILIARY || name.d_tag == DT_FILTER;
      // It would be the program itself.
      if (library && texts_[name.d_un.d_val] == '\0') Fail("it needs a library without a name");
    }
  }
  void CheckText(std::uint64_t at) const {
    if (at >= texts_.size()) Fail("a name lies outside its table of texts");
  }

  /// How many symbols there are, of which the file says nothing but by its hash table.
  void CountSymbols() {
    if (const auto at = Tag(DT_GNU_HASH)) {
      CountByGnuHash(*at);
    } else if (const auto sysv = Tag(DT_HASH)) {
      CountByHash(*sysv);
    } else {
      Fail("no table of its symbols");
    }
    constexpr std::uint64_t kMost = 1u << 24;
    if (symbol_count_ > kMost) Fail("too many symbols");
  }
  void CountByGnuHash(Address at) {
    constexpr const char* kWhat = "table of symbols";
    const auto head = ReadAt<std::uint32_t>(at, 4, kWhat);
    const std::uint64_t buckets = head[0], first = head[1], words = head[2], shift = head[3];
    if (!IsPowerOfTwo(words) || shift >= 32 || buckets == 0) Fail(kWhat);
    const Address at_buckets = at + 16 + 8 * words, at_chains = at_buckets + 4 * buckets;
    static_cast<void>(ReadAt<std::uint64_t>(at + 16, words, kWhat));
    const auto starts = ReadAt<std::uint32_t>(at_buckets, buckets, kWhat);
    std::uint64_t last = 0;
    for (const std::uint32_t start : starts) {
      if (start != 0 && start < first) Fail(kWhat);
      last = std::max<std::uint64_t>(last, start);
    }
    if (last == 0) Fail("it exports no symbol");
    // The chain of the last bucket is the last of all: its end is that of the table.
    while ((ReadAt<std::uint32_t>(at_chains + 4 * (last - first), 1, kWhat).front() & 1u) == 0) {
      ++last;
    }
    symbol_count_ = last + 1;
  }
  void CountByHash(Address at) {
    constexpr const char* kWhat = "table of symbols";
    const auto head = ReadAt<std::uint32_t>(at, 2, kWhat);
    const std::uint64_t buckets = head[0], count = head[1];
    const auto starts = ReadAt<std::uint32_t>(at + 8, buckets, kWhat);
    const auto chains = ReadAt<std::uint32_t>(at + 8 + 4 * buckets, count, kWhat);
    for (const std::uint32_t start : starts) {
      std::uint64_t steps = 0;
      for (std::uint64_t i = start; i != STN_UNDEF; i = chains[static_cast<std::size_t>(i)]) {
        if (i >= count || ++steps > count) Fail(kWhat);
      }
    }
    symbol_count_ = count;
  }

  void CheckSymbols() {
    if (Need(DT_SYMENT, "size of symbols") != sizeof(Elf64_Sym)) Fail("size of symbols");
    symbols_ = ReadAt<Elf64_Sym>(Need(DT_SYMTAB, "symbols"), symbol_count_, "symbols");
    for (const Elf64_Sym& symbol : symbols_) {
      CheckText(symbol.st_name);
      const auto type = ELF64_ST_TYPE(symbol.st_info);
      if (symbol.st_shndx == SHN_UNDEF || symbol.st_shndx == SHN_ABS || type == STT_TLS) continue;
      if (Holder(symbol.st_value, 0) == nullptr) Fail("a symbol lies outside its segments");
      if ((type == STT_FUNC || type == STT_GNU_IFUNC) &&
          Holder(symbol.st_value, 1, PF_X) == nullptr) {
        Fail("a function lies outside its code");
      }
    }
  }

  /// Versions of symbols: lists whose members say where the next is.
  void CheckVersions() {
    const auto of_symbols = Tag(DT_VERSYM);
    std::uint32_t highest = 1;
    if (const auto at = Tag(DT_VERNEED)) {
      Walk<Elf64_Verneed>(*at, [&](Address here, const Elf64_Verneed& need) {
        if (need.vn_version != VER_NEED_CURRENT) Fail("versions of symbols");
        CheckText(need.vn_file);
        Walk<Elf64_Vernaux>(here + need.vn_aux, [&](Address, const Elf64_Vernaux& one) {
          CheckText(one.vna_name);
          highest = std::max<std::uint32_t>(highest, one.vna_other & 0x7fffu);
          return one.vna_next;
        });
        return need.vn_next;
      });
    }
    if (const auto at = Tag(DT_VERDEF)) {
      Walk<Elf64_Verdef>(*at, [&](Address here, const Elf64_Verdef& define) {
        if (define.vd_version != VER_DEF_CURRENT) Fail("versions of symbols");
        CheckText(
            ReadAt<Elf64_Verdaux>(here + define.vd_aux, 1, "versions of symbols").front().vda_name);
        highest = std::max<std::uint32_t>(highest, define.vd_ndx & 0x7fffu);
        return define.vd_next;
      });
    }
    if (!of_symbols) return;
    for (const Elf64_Half version :
         ReadAt<Elf64_Half>(*of_symbols, symbol_count_, "versions of symbols")) {
      if ((version & 0x7fffu) > highest) Fail("a symbol has a version that is not there");
    }
  }
  template <class T, class F>
  void Walk(Address at, const F& next_of) const {
    constexpr int kMost = 1 << 16;
    for (int i = 0; i < kMost; ++i) {
      const std::uint32_t next = next_of(at, ReadAt<T>(at, 1, "versions of symbols").front());
      if (next == 0) return;
      at += next;
    }
    Fail("versions of symbols have no end");
  }

  void CheckRelocations(std::int64_t table, std::int64_t size_tag) {
    const auto at = Tag(table);
    if (!at) return;
    const std::uint64_t size = Need(size_tag, "size of relocations");
    if (table == DT_RELA && Tag(DT_RELAENT).value_or(0) != sizeof(Elf64_Rela)) Fail("relocations");
    if (table == DT_JMPREL && Tag(DT_PLTREL).value_or(0) != DT_RELA) Fail("relocations");
    if (size % sizeof(Elf64_Rela) != 0) Fail("relocations");
    const auto relocations = ReadAt<Elf64_Rela>(*at, size / sizeof(Elf64_Rela), "relocations");
    const std::uint64_t relative = table == DT_RELA ? Tag(DT_RELACOUNT).value_or(0) : 0;
    if (relative > relocations.size()) Fail("relocations");
    for (std::size_t i = 0; i < relocations.size(); ++i) {
      const auto type = static_cast<std::uint32_t>(ELF64_R_TYPE(relocations[i].r_info));
      if (!kRelocations.contains(type) || (i < relative && type != kRelative)) {
        Fail("a relocation of kind " + std::to_string(type));
      }
      CheckTarget(type, ELF64_R_SYM(relocations[i].r_info));
      const std::uint64_t written = type == kDescriptor ? 16 : 8;
      if (Holder(relocations[i].r_offset, written, PF_W) == nullptr) {
        Fail("a relocation outside its data");
      }
      if (type == kRelative) {
        // What lies beyond its end may be there in a trial and not in the host.
        const Elf64_Phdr& last = *loads_.back();
        if (static_cast<Address>(relocations[i].r_addend) > last.p_vaddr + last.p_memsz) {
          Fail("a relocation leads out of it");
        }
        relative_.emplace(relocations[i].r_offset, static_cast<Address>(relocations[i].r_addend));
      } else if (type == kAbsolute) {
        symbolic_.insert(relocations[i].r_offset);
      }
    }
  }

  /// The symbol of a relocation. One that is in no library, but is not looked for in others either,
  /// is where this one begins.
  void CheckTarget(std::uint32_t type, std::uint64_t at) const {
    if (at >= symbols_.size()) Fail("a relocation without a symbol");
    const Elf64_Sym& symbol = symbols_[static_cast<std::size_t>(at)];
    const bool nowhere = symbol.st_shndx == SHN_UNDEF &&
                         (symbol.st_name == 0 || ELF64_ST_BIND(symbol.st_info) == STB_LOCAL ||
                          ELF64_ST_VISIBILITY(symbol.st_other) != STV_DEFAULT);
    if (nowhere && kToSymbols.contains(type)) Fail("a relocation without a symbol");
  }

  /// DT_RELR: an address, then bits of the 63 words behind it.
  void CheckPackedRelocations() {
    const auto at = Tag(DT_RELR);
    if (!at) return;
    Address next = 0;
    const auto add = [&](Address where) {
      if (Holder(where, 8, PF_W) == nullptr) Fail("a relocation outside its data");
      packed_.insert(where);
    };
    for (const std::uint64_t entry :
         ReadAt<std::uint64_t>(*at, Need(DT_RELRSZ, "size of relocations") / 8, "relocations")) {
      if ((entry & 1u) == 0) {
        add(entry);
        next = entry + 8;
        continue;
      }
      for (int bit = 1; bit < 64; ++bit) {
        if ((entry >> bit & 1u) != 0) add(next + 8 * static_cast<Address>(bit - 1));
      }
      next += Address{8} * 63;
    }
  }

  /// What is called when the library is loaded, and when the program ends.
  void CheckFunctions() const {
    for (const std::int64_t tag : {DT_INIT, DT_FINI}) {
      const auto at = Tag(tag);
      if (at && Holder(*at, 1, PF_X) == nullptr) Fail("a function lies outside its code");
    }
    const std::pair<std::int64_t, std::int64_t> arrays[] = {{DT_INIT_ARRAY, DT_INIT_ARRAYSZ},
                                                            {DT_FINI_ARRAY, DT_FINI_ARRAYSZ}};
    for (const auto& [tag, size_tag] : arrays) {
      const auto at = Tag(tag);
      if (!at) continue;
      const std::uint64_t size = Need(size_tag, "size of functions");
      if (Holder(*at, size) == nullptr) Fail("its list of functions lies outside its segments");
      for (std::uint64_t i = 0; i < size; i += 8) CheckListed(*at + i);
    }
    if (const auto got = Tag(DT_PLTGOT); got && Holder(*got, 0) == nullptr) {
      Fail("its table of calls lies outside its segments");
    }
  }

  /// A member of a list of functions: a relocation writes where it is, or that of a symbol.
  void CheckListed(Address at) const {
    if (symbolic_.contains(at)) return;
    const auto relative = relative_.find(at);
    Address function = 0;
    if (relative != relative_.end()) {
      function = relative->second;
    } else if (packed_.contains(at)) {
      function = ReadAt<Address>(at, 1, "list of functions").front();
    } else {
      Fail("its list of functions holds what is none");
    }
    if (Holder(function, 1, PF_X) == nullptr) Fail("a function lies outside its code");
  }

  const ElfFile& file_;
  std::vector<const Elf64_Phdr*> loads_;
  const Elf64_Phdr* dynamic_ = nullptr;
  std::map<std::int64_t, std::uint64_t> tags_;
  std::vector<Elf64_Dyn> names_;  ///< of places in texts_
  std::vector<char> texts_;
  std::uint64_t symbol_count_ = 0;
  std::vector<Elf64_Sym> symbols_;
  std::map<Address, Address> relative_;  ///< what is written where, less the place of the library
  std::set<Address> packed_;             ///< where the same is written, from what stands there
  std::set<Address> symbolic_;           ///< where the place of a symbol is written
};

}  // namespace

void CheckLoadable(const ElfFile& file) { Examination(file).Run(); }

}  // namespace alidade::internal
