// SPDX-License-Identifier: Apache-2.0
// A plugin table with the fault that BAD_TABLE selects.
#include <stdexcept>

#include "alidade/model/plugin.h"
#include "probe.h"

#define MAGIC 1
#define STRUCT_SIZE 2
#define STRIDE 3
#define NULL_NAME 4
#define NULL_TABLE 5
#define NO_CREATE 6
#define NAME_TWICE 7
#define NO_ENTRY_SYMBOL 8
#define EMPTY 9
#define UNKNOWN_FLAGS 10
#define UNKNOWN_KIND 11
#define RESERVED 12
#define CONTROL_CHARACTER 13
#define LATER_HINT 14
#define THROWS 15
#define UNKNOWN_THREAD_FLAGS 16

ALIDADE_BUILD_TAG(ALIDADE_PLUGIN_C_ABI, "")

#if BAD_TABLE != NO_ENTRY_SYMBOL
extern "C" __attribute__((visibility("default"))) const AlidadeTable* alidade_plugin() {
  static AlidadeEntry entries[] = {ALIDADE_SENSOR(Probe, "probe", "", ""),
                                   ALIDADE_SENSOR(Probe, "other_probe", "", "")};
  static AlidadeTable table = alidade::detail::Table(entries, &alidade_build_tag);
  if (BAD_TABLE == MAGIC) table.magic = 0;
  if (BAD_TABLE == STRUCT_SIZE) table.struct_size = 8;
  if (BAD_TABLE == STRIDE) table.entry_stride = 3;
  if (BAD_TABLE == NULL_NAME) entries[1].name = nullptr;
  if (BAD_TABLE == NO_CREATE) entries[1].create = nullptr;
  if (BAD_TABLE == NAME_TWICE) entries[1].name = "probe";
  if (BAD_TABLE == UNKNOWN_FLAGS) entries[1].flags = 1u << 20;
  if (BAD_TABLE == UNKNOWN_THREAD_FLAGS) entries[1].thread_flags |= 1u << 20;
  if (BAD_TABLE == LATER_HINT) table.flags = entries[1].flags = 1u << 3;
  if (BAD_TABLE == RESERVED) table.reserved[3] = &table;
  if (BAD_TABLE == CONTROL_CHARACTER) entries[1].doc = "red \033[31m";
  if (BAD_TABLE == UNKNOWN_KIND) entries[1].kind = 9;
  if (BAD_TABLE == EMPTY) table.entry_count = 0;
  if (BAD_TABLE == THROWS) throw std::runtime_error("the dog ate it");
  return BAD_TABLE == NULL_TABLE ? nullptr : &table;
}
#endif
