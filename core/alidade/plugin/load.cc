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
  const std::uint32_t missing = build_tag.isa & ~InstructionSetsOfProcessor();
  if (missing != 0) {
    Refuse(file, "needs an instruction set that this processor lacks (" +
                     InstructionSetNames(missing) + "); build the plugin without -march");
  }
  if (build_tag.kind == ALIDADE_PLUGIN_CPP && std::strcmp(build_tag.build, ALIDADE_CPP_ABI) != 0) {
    Refuse(file, "is a C++ plugin for ABI number '" + std::string(build_tag.build) +
                     "', but this program has '" ALIDADE_CPP_ABI
                     "'; rebuild the plugin with this version of alidade");
  }
}

/// Loads the library. It remains loaded until the process ends.
const boost::dll::shared_library& LoadPermanently(const std::filesystem::path& file) {
  using boost::dll::load_mode::rtld_local;
  using boost::dll::load_mode::rtld_now;
  return *new boost::dll::shared_library(file, rtld_now | rtld_local);
}

}  // namespace

LoadedPlugin LoadPlugin(const std::filesystem::path& file, const std::filesystem::path& canonical) {
  CheckTrusted(file);
  const AlidadeBuildTag build_tag = ReadBuildTag(canonical);
  CheckBuild(build_tag, canonical);
  LoadedPlugin plugin{canonical, nullptr, nullptr};
  std::string defect;
  const std::string exception_text = CatchExceptionText([&] {
    const boost::dll::shared_library& library = LoadPermanently(canonical);
    if (build_tag.kind == ALIDADE_PLUGIN_CPP) {
      plugin.cpp_table = library.get<const CppPluginTable*()>(kCppEntrySymbol)();
      defect = TableDefect(plugin.cpp_table);
    } else {
      plugin.table = library.get<const AlidadeTable*()>(ALIDADE_ENTRY_SYMBOL)();
      defect = TableDefect(plugin.table);
    }
  });
  if (!exception_text.empty()) Refuse(file, "cannot be loaded: " + exception_text);
  if (!defect.empty()) Refuse(file, defect);
  return plugin;
}

const void* FactoryOnDemand(const std::string& kind, const std::string& name,
                            const std::filesystem::path& folder, const std::string& missing) {
  std::filesystem::path searched = folder;
  if (searched.empty()) {
    const std::filesystem::path library_folder = FolderOfLibrary();
    // If the folder of the library is unknown, `name` alone would refer to the working folder.
    if (!library_folder.empty()) searched = library_folder / name;
  }
  std::vector<std::filesystem::path> files;
  std::error_code error;
  std::filesystem::directory_iterator iterator(searched, error);
  for (; !error && iterator != std::filesystem::directory_iterator(); iterator.increment(error)) {
    if (iterator->path().extension() == ".so") files.push_back(iterator->path());
  }
  if (files.empty()) {
    throw Error(ExitCode::kPlugin, missing + "\n  searched " + searched.string());
  }
  if (files.size() > 1)
    Refuse(searched, "contains " + std::to_string(files.size()) + " plugins; expected one");
  const LoadedPlugin plugin = LoadPlugin(files.front(), files.front());
  if (plugin.cpp_table == nullptr || plugin.cpp_table->entries[0].kind != kind)
    Refuse(files.front(), "does not offer " + WithArticle(kind));
  return plugin.cpp_table->entries[0].factory;
}

}  // namespace alidade::internal
