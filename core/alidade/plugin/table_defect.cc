// SPDX-License-Identifier: Apache-2.0
#include "alidade/plugin/table_defect.h"

#include <cstring>
#include <set>
#include <utility>

#include "alidade/base/text.h"
#include "alidade/plugin/abi_read.h"
#include "alidade/plugin/cpp_plugin.h"

namespace alidade::internal {
namespace {

std::string Number(std::uint64_t i) { return std::to_string(i); }

std::string EntryDefect(const AlidadeEntry& entry, std::uint32_t stride) {
  if (entry.struct_size < offsetof(AlidadeEntry, reserved) || entry.struct_size > stride) {
    return "states a size of " + Number(entry.struct_size) + " bytes; expected " +
           Number(offsetof(AlidadeEntry, reserved)) + " to " + Number(stride);
  }
  if (!IsValidName(entry.name)) return "has no valid name";
  const std::pair<const char*, const char*> texts[] = {{"family", entry.family},
                                                       {"doc", entry.doc},
                                                       {"citation", entry.citation},
                                                       {"version", entry.version}};
  for (const auto& [member, text] : texts) {
    const std::string defect = TextDefect(text);
    if (!defect.empty()) return std::string("has a ") + member + " that " + defect;
  }
  if (!IsKnown(entry)) return {};
  const std::string unknown = UnknownBits(entry.flags | entry.thread_flags, 0);
  if (!unknown.empty()) return "has flags that this version does not know: " + unknown;
  if (!AllZero(entry.reserved)) return "uses reserved members, which must be zero";
  if (entry.create == nullptr) return "has no create function";
  return {};
}

std::string EntryDefect(const CppEntry& entry) {
  if (Text(entry.kind).empty()) return "an entry of its table has no kind";
  if (!IsValidName(entry.name)) return WithArticle(entry.kind) + " has no valid name";
  if (entry.factory == nullptr) return std::string(entry.name) + " has no factory";
  return {};
}

}  // namespace

bool IsKnown(const AlidadeEntry& entry) {
  return entry.kind == ALIDADE_KIND_SENSOR || entry.kind == ALIDADE_KIND_MOTION;
}

std::string TableDefect(const AlidadeTable* source) {
  if (source == nullptr) return "its table is null";
  const AlidadeTable table = ReadPrefix(source);
  if (table.magic != ALIDADE_MAGIC) return "its table has the wrong magic number";
  if (table.struct_size < offsetof(AlidadeTable, reserved)) {
    return "its table states a size of " + Number(table.struct_size) +
           " bytes; expected at least " + Number(offsetof(AlidadeTable, reserved));
  }
  if (table.abi_major != ALIDADE_ABI_MAJOR) {
    return "its table states ABI major version " + Number(table.abi_major) + "; expected " +
           Number(ALIDADE_ABI_MAJOR);
  }
  const std::string unknown = UnknownBits(table.flags, 0);
  if (!unknown.empty()) return "its table has flags that this version does not know: " + unknown;
  if (!AllZero(table.reserved)) return "its table uses reserved members, which must be zero";
  if (!IsValidStride<AlidadeEntry>(table.entry_stride)) {
    return "its table states an invalid entry stride of " + Number(table.entry_stride) + " bytes";
  }
  if (table.entry_count == 0 || table.entry_count > std::uint32_t{ALIDADE_MAX_ENTRIES} ||
      table.entries == nullptr) {
    return "its table has " + Number(table.entry_count) + " entries or a null pointer to them";
  }
  std::set<std::pair<std::uint32_t, std::string>> names;
  for (std::uint32_t i = 0; i < table.entry_count; ++i) {
    const AlidadeEntry entry = ReadEntry(table.entries, table.entry_stride, i);
    const std::string defect = EntryDefect(entry, table.entry_stride);
    if (!defect.empty()) return "entry " + Number(i) + " of its table " + defect;
    if (!names.emplace(entry.kind, entry.name).second) {
      return std::string("its table names '") + entry.name + "' twice";
    }
  }
  return {};
}

std::string TableDefect(const CppPluginTable* table) {
  if (table == nullptr) return "its table is null";
  if (table->struct_size != sizeof(CppPluginTable)) {
    return "its table states a size of " + Number(table->struct_size) + " bytes; expected " +
           Number(sizeof(CppPluginTable));
  }
  if (table->entries == nullptr || table->entry_count < 1) return "its table is empty";
  std::set<std::pair<std::string, std::string>> names;
  for (int i = 0; i < table->entry_count; ++i) {
    const CppEntry& entry = table->entries[i];
    const std::string defect = EntryDefect(entry);
    if (!defect.empty()) return defect;
    if (!names.emplace(entry.kind, entry.name).second) {
      return std::string("its table names '") + entry.name + "' twice";
    }
  }
  return {};
}

}  // namespace alidade::internal
