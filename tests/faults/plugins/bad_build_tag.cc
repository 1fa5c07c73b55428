// SPDX-License-Identifier: Apache-2.0
// A plugin with a wrong build tag. BAD_BUILD_TAG selects another ABI, another processor or another
// C++ ABI number.
#include "alidade/model/plugin.h"
#include "probe.h"

#define OTHER_ABI 1
#define OTHER_PROCESSOR 2
#define OTHER_CPP_ABI 3
#define NEEDS_MINOR 4
#define LATER_FLAG 5
#define LATER_HINT 6
#define RESERVED 7

namespace {

constexpr AlidadeBuildTag Spoiled() {
  AlidadeBuildTag f = alidade::detail::MakeBuildTag(
      BAD_BUILD_TAG == OTHER_CPP_ABI ? ALIDADE_PLUGIN_CPP : ALIDADE_PLUGIN_C_ABI, "other");
  if (BAD_BUILD_TAG == OTHER_ABI) f.abi_major = 99;
  if (BAD_BUILD_TAG == OTHER_PROCESSOR) f.isa = ALIDADE_ISA_OTHER;
  if (BAD_BUILD_TAG == NEEDS_MINOR) f.needs_minor = f.abi_minor = 3;
  if (BAD_BUILD_TAG == LATER_FLAG) f.flags |= 1u << 27;
  if (BAD_BUILD_TAG == LATER_HINT) f.flags |= 1u << 7;
  if (BAD_BUILD_TAG == RESERVED) f.reserved[6] = 1;
  return f;
}

}  // namespace

extern "C" {
__attribute__((section(ALIDADE_BUILD_TAG_SECTION), used,
               visibility("default"))) extern const AlidadeBuildTag alidade_build_tag = Spoiled();

__attribute__((visibility("default"))) const AlidadeTable* alidade_plugin() {
  static const AlidadeEntry entries[] = {ALIDADE_SENSOR(Probe, "probe", "", "")};
  static const AlidadeTable table = alidade::detail::Table(entries, &alidade_build_tag);
  return &table;
}
}
