// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstring>
#include <vector>

#include "alidade/host/abi_read.h"
#include "alidade/host/cpp_plugin.h"
#include "alidade/host/elf_file.h"
#include "alidade/host/instruction_sets.h"
#include "alidade/host/plugin_file.h"
#include "alidade/host/plugin_host.h"

namespace alidade {
namespace fs = std::filesystem;
namespace {

using internal::Refuse;

std::string Version(unsigned major, unsigned minor) {
  return std::to_string(major) + '.' + std::to_string(minor);
}

}  // namespace

AlidadeBuildTag ReadBuildTag(const fs::path& path) {
  const internal::ElfFile file(path);
  const auto section = file.FindSection(ALIDADE_BUILD_TAG_SECTION);
  if (!section) {
    Refuse(path,
           "has no alidade build tag: not an alidade plugin, or built without ALIDADE_PLUGIN, or "
           "stripped of its section headers");
  }
  const std::uint64_t size = std::min<std::uint64_t>(section->sh_size, sizeof(AlidadeBuildTag));
  const std::vector<char> bytes = file.Read<char>(section->sh_offset, size, "build tag");
  AlidadeBuildTag print{};
  if (!bytes.empty()) std::memcpy(&print, bytes.data(), bytes.size());
  constexpr std::uint32_t kFixed = offsetof(AlidadeBuildTag, kind);
  if (size < kFixed || std::memcmp(print.magic, "ALIDADE", sizeof(print.magic)) != 0) {
    Refuse(path, "malformed build tag");
  }
  if (print.abi_major != ALIDADE_ABI_MAJOR) {
    Refuse(path, "built for plugin ABI " + Version(print.abi_major, print.abi_minor) +
                     ", this program has " + Version(ALIDADE_ABI_MAJOR, ALIDADE_ABI_MINOR) +
                     "; rebuild the plugin against this version");
  }
  constexpr std::uint32_t kNeeded = offsetof(AlidadeBuildTag, reserved);
  if (print.struct_size < kNeeded || size < kNeeded ||
      (print.kind != ALIDADE_PLUGIN_C_ABI && print.kind != ALIDADE_PLUGIN_CPP)) {
    Refuse(path, "malformed build tag");
  }
  if (print.needs_minor > ALIDADE_ABI_MINOR) {
    Refuse(path, "needs plugin ABI " + Version(print.abi_major, print.needs_minor) +
                     ", this program has " + Version(ALIDADE_ABI_MAJOR, ALIDADE_ABI_MINOR) +
                     "; use a later version of alidade");
  }
  const std::string unknown =
      internal::UnknownBits(print.flags, ALIDADE_BUILT_FAST_MATH | ALIDADE_BUILT_DEBUG_STL);
  if (!unknown.empty()) {
    Refuse(path, "its build tag has flags that this version does not know: " + unknown);
  }
  if (print.reserved0 != 0 || !internal::AllZero(print.reserved)) {
    Refuse(path, "its build tag uses reserved members");
  }
  print.compiler[sizeof(print.compiler) - 1] = '\0';
  print.build[sizeof(print.build) - 1] = '\0';
  return print;
}

namespace internal {

std::optional<std::set<std::string>> ListedNames(const fs::path& path) {
  constexpr std::uint64_t kMost = 1 << 20;  // of a file that may not be trusted
  const ElfFile file(path);
  const auto section = file.FindSection(ALIDADE_NAMES_SECTION);
  if (!section || section->sh_size > kMost) return std::nullopt;
  const std::vector<char> text = file.Read<char>(section->sh_offset, section->sh_size, "names");
  if (!text.empty() && text.back() != '\0') return std::nullopt;
  std::set<std::string> names;
  for (auto at = text.begin(); at != text.end();) {
    const auto end = std::find(at, text.end(), '\0');
    names.emplace(at, end);
    at = end + 1;
  }
  return names;
}

bool MayOffer(const fs::path& path, const std::set<std::string>& names) {
  try {
    const auto listed = ListedNames(path);
    return !listed || std::ranges::any_of(
                          names, [&](const std::string& name) { return listed->contains(name); });
  } catch (const Error&) {  // OpenPlugin says why
    return true;
  }
}

const char* HostBuildId() { return ALIDADE_BUILD_ID; }

void CheckBuild(const AlidadeBuildTag& build_tag, const fs::path& file) {
  if ((build_tag.flags & ALIDADE_BUILT_FAST_MATH) != 0) {
    Refuse(file,
           "built with -ffast-math, which makes NaN and infinity undetectable; build it without");
  }
  const std::uint32_t lacking = build_tag.isa & ~InstructionSetsOfProcessor();
  if (lacking != 0) {
    Refuse(file, "needs an instruction set that this processor lacks (" +
                     InstructionSetNames(lacking) + "); build it without -march");
  }
  if (build_tag.kind == ALIDADE_PLUGIN_CPP && std::strcmp(build_tag.build, HostBuildId()) != 0) {
    Refuse(file, std::string("of another build than this program: '") + build_tag.build +
                     "'; expected '" + HostBuildId() + "'");
  }
}

}  // namespace internal
}  // namespace alidade
