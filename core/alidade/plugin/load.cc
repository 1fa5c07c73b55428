// SPDX-License-Identifier: Apache-2.0
#include "alidade/plugin/load.h"

#define BOOST_DLL_USE_STD_FS
#include <boost/dll/shared_library.hpp>
#include <cstring>
#include <system_error>

#include "alidade/base/text.h"
#include "alidade/plugin/abi_read.h"
#include "alidade/plugin/cpp_plugin.h"
#include "alidade/plugin/instruction_sets.h"
#include "alidade/plugin/plugin_folders.h"
#include "alidade/plugin/plugin_sections.h"
#include "alidade/plugin/table_defect.h"
#include "alidade/plugin/trust.h"

namespace alidade::internal {
namespace {

/// Refuses a plugin that this processor or this program cannot run.
void CheckBuild(const AlidadeBuildTag& build_tag, const std::filesystem::path& file) {
  const std::uint32_t lacking = build_tag.isa & ~InstructionSetsOfProcessor();
  if (lacking != 0) {
    Refuse(file, "needs an instruction set that this processor lacks (" +
                     InstructionSetNames(lacking) + "); build it without -march");
  }
  if (build_tag.kind == ALIDADE_PLUGIN_CPP && std::strcmp(build_tag.build, ALIDADE_CPP_ABI) != 0) {
    Refuse(file, "a C++ plugin for ABI number '" + std::string(build_tag.build) +
                     "', this program has '" ALIDADE_CPP_ABI
                     "'; build it with the alidade that is to load it");
  }
}

/// Opens the library for the rest of the process.
const boost::dll::shared_library& OpenForGood(const std::filesystem::path& file) {
  using boost::dll::load_mode::rtld_local;
  using boost::dll::load_mode::rtld_now;
  return *new boost::dll::shared_library(file, rtld_now | rtld_local);
}

}  // namespace

OpenedPlugin OpenPlugin(const std::filesystem::path& file, const std::filesystem::path& canonical) {
  CheckTrusted(file);
  const AlidadeBuildTag build_tag = ReadBuildTag(canonical);
  CheckBuild(build_tag, canonical);
  OpenedPlugin plugin{canonical, nullptr, nullptr};
  std::string defect;
  const std::string thrown = ThrownBy([&] {
    const boost::dll::shared_library& library = OpenForGood(canonical);
    if (build_tag.kind == ALIDADE_PLUGIN_CPP) {
      plugin.cpp_table = library.get<const CppPluginTable*()>(kCppEntrySymbol)();
      defect = Defect(plugin.cpp_table);
    } else {
      plugin.table = library.get<const AlidadeTable*()>(ALIDADE_ENTRY_SYMBOL)();
      defect = Defect(plugin.table);
    }
  });
  if (!thrown.empty()) Refuse(file, "cannot be loaded: " + thrown);
  if (!defect.empty()) Refuse(file, defect);
  return plugin;
}

const void* FactoryOnDemand(const std::string& kind, const std::string& name,
                            const std::filesystem::path& folder, const std::string& missing) {
  std::filesystem::path searched = folder;
  if (searched.empty()) {
    const std::filesystem::path program = FolderOfLibrary();
    if (!program.empty()) searched = program / name;  // never the working folder
  }
  std::vector<std::filesystem::path> files;
  std::error_code error;
  std::filesystem::directory_iterator at(searched, error);
  for (; !error && at != std::filesystem::directory_iterator(); at.increment(error)) {
    if (at->path().extension() == ".so") files.push_back(at->path());
  }
  if (files.empty()) {
    throw Error(ExitCode::kPlugin, missing + "\n  searched " + searched.string());
  }
  if (files.size() > 1)
    Refuse(searched, "holds " + std::to_string(files.size()) + " plugins; expected one");
  const OpenedPlugin opened = OpenPlugin(files.front(), files.front());
  if (opened.cpp_table == nullptr || opened.cpp_table->entries[0].kind != kind)
    Refuse(files.front(), "does not offer " + WithArticle(kind));
  return opened.cpp_table->entries[0].factory;
}

}  // namespace alidade::internal
