// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "alidade/model/plugin_abi.h"

/// Build tag, which describes how a plugin was built. It can be read from the file of the plugin
/// before the file is loaded.
namespace alidade::detail {

template <std::size_t N>
constexpr void CopyText(const char* text, char (&destination)[N]) {
  for (std::size_t i = 0; i + 1 < N && text[i] != '\0'; ++i) destination[i] = text[i];
}

/// Returns the flags ALIDADE_ISA_* of the instruction sets that the compiler may use in this
/// translation unit, also without intrinsics. Covers the sets with registers of up to 256 bits.
constexpr std::uint32_t InstructionSetsTo256() {
  std::uint32_t isa = 0;
#if defined(__SSE3__)
  isa |= ALIDADE_ISA_SSE3;
#endif
#if defined(__SSSE3__)
  isa |= ALIDADE_ISA_SSSE3;
#endif
#if defined(__SSE4_1__)
  isa |= ALIDADE_ISA_SSE4_1;
#endif
#if defined(__SSE4_2__)
  isa |= ALIDADE_ISA_SSE4_2;
#endif
#if defined(__POPCNT__)
  isa |= ALIDADE_ISA_POPCNT;
#endif
#if defined(__AVX__)
  isa |= ALIDADE_ISA_AVX;
#endif
#if defined(__F16C__)
  isa |= ALIDADE_ISA_F16C;
#endif
#if defined(__FMA__)
  isa |= ALIDADE_ISA_FMA;
#endif
#if defined(__AVX2__)
  isa |= ALIDADE_ISA_AVX2;
#endif
#if defined(__BMI__)
  isa |= ALIDADE_ISA_BMI;
#endif
#if defined(__BMI2__)
  isa |= ALIDADE_ISA_BMI2;
#endif
#if defined(__LZCNT__)
  isa |= ALIDADE_ISA_LZCNT;
#endif
#if defined(__MOVBE__)
  isa |= ALIDADE_ISA_MOVBE;
#endif
  return isa;
}

/// Returns these flags for all other instruction sets, such as AVX-512.
constexpr std::uint32_t InstructionSetsBeyond256() {
  std::uint32_t isa = 0;
#if defined(__AVX512F__)
  isa |= ALIDADE_ISA_AVX512F;
#endif
#if defined(__AVX512BW__)
  isa |= ALIDADE_ISA_AVX512BW;
#endif
#if defined(__AVX512CD__)
  isa |= ALIDADE_ISA_AVX512CD;
#endif
#if defined(__AVX512DQ__)
  isa |= ALIDADE_ISA_AVX512DQ;
#endif
#if defined(__AVX512VL__)
  isa |= ALIDADE_ISA_AVX512VL;
#endif
#if defined(__AVX512IFMA__)
  isa |= ALIDADE_ISA_AVX512IFMA;
#endif
#if defined(__AVX512VBMI__)
  isa |= ALIDADE_ISA_AVX512VBMI;
#endif
#if defined(__AVX512VBMI2__)
  isa |= ALIDADE_ISA_AVX512VBMI2;
#endif
#if defined(__AVX512VNNI__)
  isa |= ALIDADE_ISA_AVX512VNNI;
#endif
#if defined(__AVX512BITALG__)
  isa |= ALIDADE_ISA_AVX512BITALG;
#endif
#if defined(__AVX512VPOPCNTDQ__)
  isa |= ALIDADE_ISA_AVX512VPOPCNTDQ;
#endif
#if defined(__AVX512BF16__)
  isa |= ALIDADE_ISA_AVX512BF16;
#endif
#if defined(__AVX512FP16__)
  isa |= ALIDADE_ISA_AVX512FP16;
#endif
#if defined(__AVXVNNI__)
  isa |= ALIDADE_ISA_AVXVNNI;
#endif
#if defined(__GFNI__)
  isa |= ALIDADE_ISA_GFNI;
#endif
#if defined(__XOP__) || defined(__FMA4__) || defined(__TBM__) || defined(__AVX512ER__) || \
    defined(__AVX512PF__) || defined(__AVX10_1__) || defined(__APX_F__)
  isa |= ALIDADE_ISA_OTHER;
#endif
  return isa;
}

constexpr AlidadeBuildTag MakeBuildTag(std::uint32_t kind, const char* build) {
  AlidadeBuildTag f{};
  CopyText("ALIDADE", f.magic);
  f.struct_size = sizeof(AlidadeBuildTag);
  f.abi_major = ALIDADE_ABI_MAJOR;
  f.abi_minor = ALIDADE_ABI_MINOR;
  f.kind = kind;
  f.isa = InstructionSetsTo256() | InstructionSetsBeyond256();
  f.cplusplus = static_cast<std::uint32_t>(__cplusplus);
  CopyText(__VERSION__, f.compiler);
  CopyText(build, f.build);
  return f;
}

/// Names of the entries of a plugin, each followed by a zero byte.
template <std::size_t kSize>
struct EntryNames {
  char text[kSize] = {};
};
template <class Entry, std::size_t N>
constexpr std::size_t SizeOfNames(const Entry (&entries)[N]) {
  std::size_t size = 0;
  for (const Entry& entry : entries) {
    for (const char* character = entry.name; *character != '\0'; ++character) ++size;
    ++size;
  }
  return size;
}
template <std::size_t kSize, class Entry, std::size_t N>
constexpr EntryNames<kSize> NamesOf(const Entry (&entries)[N]) {
  EntryNames<kSize> names;
  std::size_t size = 0;
  for (const Entry& entry : entries) {
    for (const char* character = entry.name; *character != '\0'; ++character)
      names.text[size++] = *character;
    ++size;
  }
  return names;
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

/// Defines the build tag in the section ALIDADE_BUILD_TAG_SECTION. `kind` is ALIDADE_PLUGIN_*.
/// `build` is ALIDADE_CPP_ABI for a C++ plugin and "" for a C-ABI plugin.
#define ALIDADE_BUILD_TAG(kind, build)                                                    \
  extern "C" {                                                                            \
  __attribute__((section(ALIDADE_BUILD_TAG_SECTION), used,                                \
                 visibility("default"))) extern const AlidadeBuildTag alidade_build_tag = \
      alidade::detail::MakeBuildTag(kind, build);                                         \
  }

/// Stores the names of the entries in the section ALIDADE_NAMES_SECTION. `entries` is a constexpr
/// array.
#define ALIDADE_ENTRY_NAMES(entries)                                                          \
  __attribute__((section(ALIDADE_NAMES_SECTION), used)) static constexpr auto alidade_names = \
      alidade::detail::NamesOf<alidade::detail::SizeOfNames(entries)>(entries);
