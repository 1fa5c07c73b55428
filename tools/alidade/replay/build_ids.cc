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

/// Returns the build id from the notes of a segment, as hexadecimal digits. Returns "" if the notes
/// do not contain a build id.
std::string FindBuildId(std::string_view notes) {
  const auto padded = [](std::size_t size) { return (size + 3) / 4 * 4; };
  ElfW(Nhdr) header;
  while (notes.size() >= sizeof header) {
    std::memcpy(&header, notes.data(), sizeof header);
    notes.remove_prefix(sizeof header);
    const std::size_t name_size = padded(header.n_namesz), id_size = padded(header.n_descsz);
    if (notes.size() < name_size || notes.size() - name_size < id_size) return "";
    if (header.n_type == NT_GNU_BUILD_ID && notes.starts_with(ELF_NOTE_GNU)) {
      constexpr const char* kHex = "0123456789abcdef";
      std::string text;
      for (const char c : notes.substr(name_size, header.n_descsz)) {
        const auto byte = static_cast<unsigned char>(c);
        (text += kHex[byte >> 4]) += kHex[byte & 15];
      }
      return text;
    }
    notes.remove_prefix(name_size + id_size);
  }
  return "";
}

std::string BuildIdOf(const dl_phdr_info& object) {
  for (int i = 0; i < object.dlpi_phnum; ++i) {
    const ElfW(Phdr)& segment = object.dlpi_phdr[i];
    if (segment.p_type != PT_NOTE) continue;
    // NOLINTNEXTLINE(performance-no-int-to-ptr): the loader reports addresses as integers
    const auto* const start = reinterpret_cast<const char*>(object.dlpi_addr + segment.p_vaddr);
    if (const std::string id = FindBuildId({start, segment.p_memsz}); !id.empty()) return id;
  }
  const bool is_program = *object.dlpi_name == '\0';
  return Sha256OfFile(is_program ? "/proc/self/exe" : object.dlpi_name);
}

/// Returns the name under which an object is recorded. Returns "" if the object is not recorded.
std::string NameOf(const dl_phdr_info& object) {
  if (*object.dlpi_name == '\0') return kProgram;
  const std::string name = std::filesystem::path(object.dlpi_name).filename().string();
  const auto starts = [&](const char* start) { return name.starts_with(start); };
  return std::ranges::any_of(std::array{"libalidade-", "libm."}, starts) ? name : "";
}

}  // namespace

std::map<std::string, std::string> BuildIds() {
  std::map<std::string, std::string> ids;
  const auto add = [](dl_phdr_info* object, std::size_t, void* user_data) {
    auto& ids_by_name = *static_cast<std::map<std::string, std::string>*>(user_data);
    if (const std::string name = NameOf(*object); !name.empty())
      ids_by_name.emplace(name, BuildIdOf(*object));
    return 0;
  };
  dl_iterate_phdr(add, &ids);
  ids["processor"] = InstructionSetNames(InstructionSetsOfProcessor());
  ids["kernels"] = ToString(BestInstructionSet());
  return ids;
}

}  // namespace alidade::internal
