// SPDX-License-Identifier: Apache-2.0
#include "alidade/plugin/instruction_sets.h"

#if defined(__x86_64__)
#include <cpuid.h>
#endif

#include <algorithm>
#include <cstdint>
#include <iterator>

#include "alidade/model/plugin_abi.h"

namespace alidade::internal {
namespace {

enum Register { kEax, kEbx, kEcx, kEdx };
/// Registers that the operating system must save for an instruction set, as bits of XCR0.
enum : std::uint32_t { kNothing = 0, kYmm = 0x6, kZmm = 0xe6 };

/// Instruction set. The members `leaf` to `bit` are its position in the output of cpuid.
struct InstructionSet {
  std::uint32_t isa;
  const char* name;
  std::uint32_t leaf, subleaf;
  Register output;
  int bit;
  std::uint32_t saved = kNothing;
};

constexpr std::uint32_t kExtended = 0x80000001u;
/// Known instruction sets, sorted by leaf.
constexpr InstructionSet kKnown[] = {
    {ALIDADE_ISA_SSE3, "SSE3", 1, 0, kEcx, 0},
    {ALIDADE_ISA_SSSE3, "SSSE3", 1, 0, kEcx, 9},
    {ALIDADE_ISA_SSE4_1, "SSE4.1", 1, 0, kEcx, 19},
    {ALIDADE_ISA_SSE4_2, "SSE4.2", 1, 0, kEcx, 20},
    {ALIDADE_ISA_POPCNT, "POPCNT", 1, 0, kEcx, 23},
    {ALIDADE_ISA_AVX, "AVX", 1, 0, kEcx, 28, kYmm},
    {ALIDADE_ISA_F16C, "F16C", 1, 0, kEcx, 29, kYmm},
    {ALIDADE_ISA_FMA, "FMA", 1, 0, kEcx, 12, kYmm},
    {ALIDADE_ISA_MOVBE, "MOVBE", 1, 0, kEcx, 22},
    {ALIDADE_ISA_AVX2, "AVX2", 7, 0, kEbx, 5, kYmm},
    {ALIDADE_ISA_BMI, "BMI", 7, 0, kEbx, 3},
    {ALIDADE_ISA_BMI2, "BMI2", 7, 0, kEbx, 8},
    {ALIDADE_ISA_AVX512F, "AVX-512F", 7, 0, kEbx, 16, kZmm},
    {ALIDADE_ISA_AVX512BW, "AVX-512BW", 7, 0, kEbx, 30, kZmm},
    {ALIDADE_ISA_AVX512CD, "AVX-512CD", 7, 0, kEbx, 28, kZmm},
    {ALIDADE_ISA_AVX512DQ, "AVX-512DQ", 7, 0, kEbx, 17, kZmm},
    {ALIDADE_ISA_AVX512VL, "AVX-512VL", 7, 0, kEbx, 31, kZmm},
    {ALIDADE_ISA_AVX512IFMA, "AVX-512IFMA", 7, 0, kEbx, 21, kZmm},
    {ALIDADE_ISA_AVX512VBMI, "AVX-512VBMI", 7, 0, kEcx, 1, kZmm},
    {ALIDADE_ISA_AVX512VBMI2, "AVX-512VBMI2", 7, 0, kEcx, 6, kZmm},
    {ALIDADE_ISA_AVX512VNNI, "AVX-512VNNI", 7, 0, kEcx, 11, kZmm},
    {ALIDADE_ISA_AVX512BITALG, "AVX-512BITALG", 7, 0, kEcx, 12, kZmm},
    {ALIDADE_ISA_AVX512VPOPCNTDQ, "AVX-512VPOPCNTDQ", 7, 0, kEcx, 14, kZmm},
    {ALIDADE_ISA_AVX512FP16, "AVX-512FP16", 7, 0, kEdx, 23, kZmm},
    {ALIDADE_ISA_GFNI, "GFNI", 7, 0, kEcx, 8},
    {ALIDADE_ISA_AVX512BF16, "AVX-512BF16", 7, 1, kEax, 5, kZmm},
    {ALIDADE_ISA_AVXVNNI, "AVX-VNNI", 7, 1, kEax, 4, kYmm},
    {ALIDADE_ISA_LZCNT, "LZCNT", kExtended, 0, kEcx, 5},
};

#if defined(__x86_64__)
/// Returns XCR0, or 0 if the operating system does not provide it.
std::uint32_t SavedRegisters() {
  std::uint32_t a = 0, b = 0, c = 0, d = 0;
  constexpr std::uint32_t kOsxsave = 1u << 27;
  if (__get_cpuid(1, &a, &b, &c, &d) == 0 || (c & kOsxsave) == 0) return 0;
  std::uint32_t low = 0, high = 0;
  __asm__("xgetbv" : "=a"(low), "=d"(high) : "c"(0));
  return low;
}

/// Reads the instruction sets of the processor. Calls cpuid only once for each leaf, because cpuid
/// is slow in a virtual machine.
std::uint32_t ReadInstructionSets() {
  const std::uint32_t saved = SavedRegisters();
  std::uint32_t isa = 0, registers[4] = {};
  const InstructionSet* last = nullptr;
  for (const InstructionSet& set : kKnown) {
    if (last == nullptr || last->leaf != set.leaf || last->subleaf != set.subleaf) {
      // The registers remain zero if the processor lacks the leaf.
      std::ranges::fill(registers, 0u);
      __get_cpuid_count(set.leaf, set.subleaf, &registers[kEax], &registers[kEbx], &registers[kEcx],
                        &registers[kEdx]);
    }
    last = &set;
    const bool is_supported = (registers[set.output] >> set.bit & 1u) != 0;
    if (is_supported && (saved & set.saved) == set.saved) isa |= set.isa;
  }
  return isa;
}
#endif

}  // namespace

std::uint32_t InstructionSetsOfProcessor() {
#if defined(__x86_64__)
  static const std::uint32_t isa = ReadInstructionSets();
  return isa;
#else
  return 0;
#endif
}

std::string InstructionSetNames(std::uint32_t isa) {
  std::string names;
  for (std::uint32_t bit = 1; bit != 0; bit <<= 1) {
    if ((isa & bit) == 0) continue;
    const auto* const entry = std::ranges::find(kKnown, bit, &InstructionSet::isa);
    if (!names.empty()) names += ", ";
    names += entry != std::end(kKnown) ? entry->name : "an unknown set, bit " + std::to_string(bit);
  }
  return names;
}

}  // namespace alidade::internal
