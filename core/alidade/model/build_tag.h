// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "alidade/model/plugin_abi.h"

/// What a binary says of how it was built, readable from its file without opening it as a library.
namespace alidade::detail {

template <std::size_t N>
constexpr void CopyText(const char* text, char (&to)[N]) {
  for (std::size_t i = 0; i + 1 < N && text[i] != '\0'; ++i) to[i] = text[i];
}

constexpr AlidadeBuildTag MakeBuildTag(std::uint32_t kind, const char* build) {
  AlidadeBuildTag f{};
  CopyText("ALIDADE", f.magic);
  f.struct_size = sizeof(AlidadeBuildTag);
  f.abi_major = ALIDADE_ABI_MAJOR;
  f.abi_minor = ALIDADE_ABI_MINOR;
  f.kind = kind;
#if defined(__FAST_MATH__) || (defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__)
  f.flags |= ALIDADE_BUILT_FAST_MATH;
#endif
#if defined(_GLIBCXX_DEBUG)
  f.flags |= ALIDADE_BUILT_DEBUG_STL;
#endif
#if !defined(__OPTIMIZE__)
  f.flags |= ALIDADE_BUILT_UNOPTIMISED;
#endif
#if defined(__AVX__)
  f.isa |= ALIDADE_ISA_AVX;
#endif
#if defined(__AVX2__)
  f.isa |= ALIDADE_ISA_AVX2;
#endif
#if defined(__FMA__)
  f.isa |= ALIDADE_ISA_FMA;
#endif
#if defined(__AVX512F__)
  f.isa |= ALIDADE_ISA_AVX512F;
#endif
  f.cplusplus = static_cast<std::uint32_t>(__cplusplus);
  CopyText(__VERSION__, f.compiler);
  CopyText(build, f.build);
  return f;
}

template <std::size_t N>
constexpr AlidadeTable Table(const AlidadeEntry (&entries)[N], const AlidadeBuildTag* build_tag) {
  AlidadeTable table{};
  table.struct_size = sizeof(AlidadeTable);
  table.magic = ALIDADE_MAGIC;
  table.abi_major = ALIDADE_ABI_MAJOR;
  table.abi_minor = ALIDADE_ABI_MINOR;
  table.entry_stride = sizeof(AlidadeEntry);
  table.entry_count = N;
  table.entries = entries;
  table.build_tag = build_tag;
  return table;
}

}  // namespace alidade::detail

/// Lays the build tag into its section: `kind` ALIDADE_PLUGIN_*, `build` to equal the host's.
#define ALIDADE_BUILD_TAG(kind, build)                                                    \
  extern "C" {                                                                            \
  __attribute__((section(ALIDADE_BUILD_TAG_SECTION), used,                                \
                 visibility("default"))) extern const AlidadeBuildTag alidade_build_tag = \
      alidade::detail::MakeBuildTag(kind, build);                                         \
  }
