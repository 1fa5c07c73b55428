// SPDX-License-Identifier: Apache-2.0
//
// How glibc's ld.so finds a library (ld.so(8)): by the RPATH of who needs it and of those that need
// that, unless it has a RUNPATH; then by LD_LIBRARY_PATH, its RUNPATH, and the system's folders.
#include "alidade/host/needed_libraries.h"

#include <dlfcn.h>

#include <algorithm>
#include <set>
#include <string_view>
#include <vector>

#include "alidade/host/elf_file.h"

namespace alidade::internal {
namespace {

namespace fs = std::filesystem;
using Folders = std::vector<std::string>;

/// What the table for the dynamic loader of a library says of others.
struct Needs {
  std::vector<std::string> libraries;
  Folders rpath, runpath;
  bool has_runpath = false;
};

/// `$ORIGIN/lib:/opt/lib` as folders, $ORIGIN that of the library. Of one with another word that
/// the loader replaces, what stands before that.
Folders Split(const std::string& text, const std::string& origin) {
  Folders folders(1);
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto at = [&](std::string_view word) { return text.compare(i, word.size(), word) == 0; };
    if (text[i] == ':') {
      folders.emplace_back();
    } else if (at("${ORIGIN}") || at("$ORIGIN")) {
      folders.back() += origin;
      i += (at("${ORIGIN}") ? 9 : 7) - 1;
    } else if (text[i] == '$') {
      i = std::min(text.find(':', i), text.size()) - 1;
    } else {
      folders.back() += text[i];
    }
  }
  return folders;
}

/// The table of texts, which the table for the dynamic loader places by its address.
std::vector<char> Texts(const ElfFile& file, std::uint64_t address, std::uint64_t size) {
  for (const Elf64_Phdr& load : file.segments()) {
    if (load.p_type == PT_LOAD && address >= load.p_vaddr &&
        address - load.p_vaddr < load.p_filesz) {
      return file.Read<char>(load.p_offset + (address - load.p_vaddr), size, "table of texts");
    }
  }
  return {};
}

Needs ReadNeeds(const fs::path& library) {
  const ElfFile file(library);
  std::vector<Elf64_Dyn> entries;
  for (const Elf64_Phdr& segment : file.segments()) {
    if (segment.p_type != PT_DYNAMIC) continue;
    entries = file.Read<Elf64_Dyn>(segment.p_offset, segment.p_filesz / sizeof(Elf64_Dyn),
                                   "table for the dynamic loader");
  }
  entries.erase(std::ranges::find(entries, DT_NULL, &Elf64_Dyn::d_tag), entries.end());
  const auto value = [&](std::int64_t tag) {
    const auto found = std::ranges::find(entries, tag, &Elf64_Dyn::d_tag);
    return found == entries.end() ? 0 : found->d_un.d_val;
  };
  std::vector<char> texts = Texts(file, value(DT_STRTAB), value(DT_STRSZ));
  texts.push_back('\0');
  const auto text = [&](const Elf64_Dyn& entry) {
    return std::string(texts.data() + std::min<std::uint64_t>(entry.d_un.d_val, texts.size() - 1));
  };
  const std::string origin = library.parent_path().string();
  Needs needs;
  for (const Elf64_Dyn& entry : entries) {
    if (entry.d_tag == DT_NEEDED || entry.d_tag == DT_AUXILIARY || entry.d_tag == DT_FILTER)
      needs.libraries.push_back(Split(text(entry), origin).front());
    if (entry.d_tag == DT_RPATH) needs.rpath = Split(text(entry), origin);
    if (entry.d_tag != DT_RUNPATH) continue;
    needs.runpath = Split(text(entry), origin);
    needs.has_runpath = true;
  }
  return needs;
}

/// Whether the program has it, so that it is not looked for again.
bool IsLoaded(const std::string& name) {
  void* const library = dlopen(name.c_str(), RTLD_LAZY | RTLD_NOLOAD);
  if (library != nullptr) dlclose(library);
  return library != nullptr;
}

class NeedsCheck {
 public:
  explicit NeedsCheck(const fs::path& plugin) : plugin_(plugin) {}

  /// `inherited`: the RPATH of those that need `library`, which is there. $ORIGIN is the folder
  /// where it was found, not the one that a link leads to.
  void Run(const fs::path& library, Folders inherited) {
    if (!seen_.insert(fs::canonical(library)).second) return;
    const Needs needs = ReadNeeds(library);
    if (!needs.has_runpath)
      inherited.insert(inherited.begin(), needs.rpath.begin(), needs.rpath.end());
    for (const std::string& name : needs.libraries) {
      if (name.find('/') != name.npos) {
        Follow(name, name, inherited);
      } else if (!IsLoaded(name)) {
        Search(name, needs.has_runpath ? needs.runpath : inherited, inherited);
      }
    }
  }

 private:
  void Search(const std::string& name, const Folders& folders, const Folders& inherited) {
    for (const std::string& folder : folders) {
      if (Follow(name, fs::path(folder) / name, inherited)) return;
    }
  }
  /// True where the library is there.
  bool Follow(const std::string& name, const fs::path& place, const Folders& inherited) {
    CheckTrustedNeed(plugin_, name, place);
    std::error_code error;
    if (!fs::exists(place, error)) return false;
    Run(place, inherited);
    return true;
  }

  const fs::path& plugin_;
  std::set<fs::path> seen_;
};

}  // namespace

void CheckTrustedNeeds(const fs::path& plugin) { NeedsCheck(plugin).Run(plugin, {}); }

}  // namespace alidade::internal
