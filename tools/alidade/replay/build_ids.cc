// SPDX-License-Identifier: Apache-2.0
#include "alidade/replay/build_ids.h"

#include <elf.h>
#include <link.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <filesystem>
#include <string_view>

#include "alidade/io/sha256.h"
#include "alidade/plugin/instruction_sets.h"
#include "alidade/state/instruction_set.h"

namespace alidade::internal {
namespace {

constexpr const char* kProgram = "program";

/// The build id among the notes of a segment, as hexadecimal digits; "": it is not there.
std::string BuildIdIn(std::string_view notes) {
  const auto padded = [](std::size_t size) { return (size + 3) / 4 * 4; };
  ElfW(Nhdr) head;
  while (notes.size() >= sizeof head) {
    std::memcpy(&head, notes.data(), sizeof head);
    notes.remove_prefix(sizeof head);
    const std::size_t name = padded(head.n_namesz), size = padded(head.n_descsz);
    if (notes.size() < name || notes.size() - name < size) return "";
    if (head.n_type == NT_GNU_BUILD_ID && notes.starts_with(ELF_NOTE_GNU)) {
      constexpr const char* kHex = "0123456789abcdef";
      std::string text;
      for (const char c : notes.substr(name, head.n_descsz)) {
        const auto byte = static_cast<unsigned char>(c);
        (text += kHex[byte >> 4]) += kHex[byte & 15];
      }
      return text;
    }
    notes.remove_prefix(name + size);
  }
  return "";
}

std::string BuildIdOf(const dl_phdr_info& object) {
  for (int i = 0; i < object.dlpi_phnum; ++i) {
    const ElfW(Phdr)& segment = object.dlpi_phdr[i];
    if (segment.p_type != PT_NOTE) continue;
    // NOLINTNEXTLINE(performance-no-int-to-ptr): the loader tells addresses as integers
    const auto* const start = reinterpret_cast<const char*>(object.dlpi_addr + segment.p_vaddr);
    if (const std::string id = BuildIdIn({start, segment.p_memsz}); !id.empty()) return id;
  }
  const bool is_program = *object.dlpi_name == '\0';
  return Sha256OfFile(is_program ? "/proc/self/exe" : object.dlpi_name);
}

/// What an object counts as; "": it does not count.
std::string NameOf(const dl_phdr_info& object) {
  if (*object.dlpi_name == '\0') return kProgram;
  const std::string name = std::filesystem::path(object.dlpi_name).filename().string();
  const auto starts = [&](const char* start) { return name.starts_with(start); };
  return std::ranges::any_of(std::array{"libalidade-", "libm."}, starts) ? name : "";
}

}  // namespace

std::map<std::string, std::string> BuildIds() {
  std::map<std::string, std::string> ids;
  const auto add = [](dl_phdr_info* object, std::size_t, void* all) {
    auto& found = *static_cast<std::map<std::string, std::string>*>(all);
    if (const std::string name = NameOf(*object); !name.empty())
      found.emplace(name, BuildIdOf(*object));
    return 0;
  };
  dl_iterate_phdr(add, &ids);
  ids["processor"] = InstructionSetNames(InstructionSetsOfProcessor());
  ids["kernels"] = ToString(BestInstructionSet());
  return ids;
}

}  // namespace alidade::internal
