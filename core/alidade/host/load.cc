// SPDX-License-Identifier: Apache-2.0
#include <cxxabi.h>
#include <dlfcn.h>
#include <link.h>

#define BOOST_DLL_USE_STD_FS
#include <algorithm>
#include <bit>
#include <boost/dll/shared_library.hpp>
#include <csetjmp>
#include <cstdlib>
#include <exception>
#include <span>
#include <system_error>
#include <vector>

#include "alidade/base/child_process.h"
#include "alidade/host/abi_read.h"
#include "alidade/host/cpp_plugin.h"
#include "alidade/host/elf_file.h"
#include "alidade/host/foreign_call.h"
#include "alidade/host/loadable.h"
#include "alidade/host/needed_libraries.h"
#include "alidade/host/plugin_file.h"
#include "alidade/host/process_settings.h"

namespace alidade::internal {
namespace {

constexpr double kTimeLimit_s = 30.0;

std::string DlError() {
  const char* text = dlerror();
  return text == nullptr ? "unknown reason" : text;
}

template <class Table>
std::string WalkTable(void* library, const char* symbol) {
  void* const function = dlsym(library, symbol);
  if (function == nullptr) return "does not export " + std::string(symbol) + ": " + DlError();
  return Defect(reinterpret_cast<const Table* (*)()>(function)());
}

/// In the child: where it goes on after the exit functions of plugins, once it calls them.
std::jmp_buf after_exit_functions;
bool calls_exit_functions = false;

/// To be called in the child before plugins are loaded: exit functions from here on are theirs.
void BeginExitFunctions() {
  std::atexit([] {
    if (calls_exit_functions) std::longjmp(after_exit_functions, 1);
  });
}

/// Calls what the libraries, opened since BeginExitFunctions, have run as the process ends: a crash
/// is better found in the child. dlclose would not, as many a C++ library is never unloaded. They
/// get numbers that are no addresses: what works with what the registers happen to hold fails here.
void RunDestructors(std::span<void* const> opened) {
  using Function = void (*)(long, long, long, long, long, long, ...);
  for (auto library = opened.rbegin(); library != opened.rend(); ++library) {
    link_map* loaded = nullptr;
    if (::dlinfo(*library, RTLD_DI_LINKMAP, static_cast<void*>(&loaded)) != 0) continue;
    const auto at = [&](ElfW(Addr) address) { return std::bit_cast<Function*>(address); };
    Function* functions = nullptr;
    Function last = nullptr;
    std::size_t count = 0;
    for (const ElfW(Dyn)* entry = loaded->l_ld; entry->d_tag != DT_NULL; ++entry) {
      const ElfW(Addr) address = loaded->l_addr + entry->d_un.d_ptr;
      if (entry->d_tag == DT_FINI_ARRAY) functions = at(address);
      if (entry->d_tag == DT_FINI_ARRAYSZ) count = entry->d_un.d_val / sizeof(Function);
      if (entry->d_tag == DT_FINI) last = std::bit_cast<Function>(address);
    }
    while (functions != nullptr && count > 0) functions[--count](1, 1, 1, 1, 1, 1);
    if (last != nullptr) last(1, 1, 1, 1, 1, 1);
  }
  // What is left, down to that of BeginExitFunctions, which comes back here.
  calls_exit_functions = true;
  if (setjmp(after_exit_functions) == 0) abi::__cxa_finalize(nullptr);
}

/// In the child, which calls the destructors of what is then `opened`.
std::string Try(const std::filesystem::path& file, std::uint32_t kind, std::vector<void*>& opened) {
  const Surroundings before;
  void* const library = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr) return "cannot be loaded: " + DlError();
  const std::string change = Surroundings().ChangeSince(before);
  if (!change.empty()) return change + " while loading";
  opened.push_back(library);
  return kind == ALIDADE_PLUGIN_CPP ? WalkTable<CppPluginTable>(library, kCppEntrySymbol)
                                    : WalkTable<AlidadeTable>(library, ALIDADE_ENTRY_SYMBOL);
}

/// Opens the plugin in a child process, looks its entry up and walks its table. Returns "" or why
/// that failed.
std::string TrialLoad(const std::filesystem::path& file, std::uint32_t kind) {
  const SharedJournal journal;
  const ChildEnd end = RunInChild({kTimeLimit_s, 0}, *journal, [&] {
    std::string failure;
    const std::string thrown = ThrownBy([&] {
      BeginExitFunctions();
      std::vector<void*> opened;
      failure = Try(file, kind, opened);
      if (!failure.empty()) return;
      journal->Enter("destructors");
      RunDestructors(opened);
    });
    return thrown.empty() ? failure : "threw while loading: " + thrown;
  });
  const bool ends = !journal->call().empty();
  if (!end.answered) {
    return end.text + (ends ? " in the destructors of its statics" : " while loading");
  }
  if (end.text.empty() && !end.printed.empty()) return "prints '" + end.printed + "' while loading";
  return end.text;
}

/// All that can be found without loading it. Errors: kPlugin, kNotTrusted.
AlidadeBuildTag Examine(const std::filesystem::path& file, const std::filesystem::path& canonical) {
  const AlidadeBuildTag build_tag = ReadBuildTag(canonical);
  CheckBuild(build_tag, canonical);
  CheckTrusted(file);
  CheckLoadable(ElfFile(canonical));
  CheckTrustedNeeds(canonical);
  return build_tag;
}

/// A name that the plugin offers and its list lacks, or "".
std::string UnlistedName(const OpenedPlugin& plugin) {
  const auto listed = ListedNames(plugin.file);
  if (!listed) return {};
  std::vector<std::string> offered;
  if (const CppPluginTable* const cpp = plugin.cpp_table) {
    for (int i = 0; i < cpp->source_count; ++i) offered.emplace_back(cpp->sources[i].name);
    for (int i = 0; i < cpp->estimator_count; ++i) offered.emplace_back(cpp->estimators[i].name);
  } else {
    const AlidadeTable table = ReadPrefix(plugin.table);
    for (std::uint32_t i = 0; i < table.entry_count; ++i) {
      offered.emplace_back(ReadEntry(table.entries, table.entry_stride, i).name);
    }
  }
  const auto is_unlisted = [&](const std::string& name) { return !listed->contains(name); };
  const auto found = std::ranges::find_if(offered, is_unlisted);
  return found == offered.end() ? "" : *found;
}

/// Opens the library for the rest of the process.
const boost::dll::shared_library& OpenForGood(const std::filesystem::path& file) {
  using boost::dll::load_mode::rtld_local;
  using boost::dll::load_mode::rtld_now;
  return *new boost::dll::shared_library(file, rtld_now | rtld_local);
}

}  // namespace

std::set<std::filesystem::path> TryTogether(const std::set<std::filesystem::path>& files) {
  constexpr double kMostSeconds = 5.0;
  struct Examined {
    std::filesystem::path file, canonical;
    std::uint32_t kind;
  };
  std::vector<Examined> all;
  for (const std::filesystem::path& file : files) {
    try {
      const std::filesystem::path canonical = std::filesystem::canonical(file);
      all.push_back({file, canonical, Examine(file, canonical).kind});
    } catch (const std::exception&) {  // OpenPlugin says why
    }
  }
  if (all.empty()) return {};
  const SharedJournal journal;
  const ChildEnd end = RunInChild({kMostSeconds, 0}, *journal, [&]() -> std::string {
    BeginExitFunctions();
    std::vector<void*> opened;  // they may share statics: none is destroyed before all are tried
    for (const Examined& one : all) {
      if (!Try(one.canonical, one.kind, opened).empty()) return "one fails";
    }
    RunDestructors(opened);
    return "";
  });
  std::set<std::filesystem::path> good;
  if (!end.answered || !end.text.empty() || !end.printed.empty()) return good;
  for (const Examined& one : all) good.insert(one.file);
  return good;
}

OpenedPlugin OpenPlugin(const std::filesystem::path& file, const std::filesystem::path& canonical,
                        bool tried) {
  const AlidadeBuildTag build_tag = tried ? ReadBuildTag(canonical) : Examine(file, canonical);
  const std::string failure = tried ? std::string() : TrialLoad(canonical, build_tag.kind);
  if (!failure.empty()) Refuse(file, failure);

  const bool unoptimised = (build_tag.flags & ALIDADE_BUILT_UNOPTIMISED) != 0;
  OpenedPlugin plugin{canonical, nullptr, nullptr, unoptimised};
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
  if (const std::string name = UnlistedName(plugin); !name.empty()) {
    Refuse(file, "offers '" + name + "', which its list of names lacks");
  }
  return plugin;
}

PluginOnDemand OpenOnDemand(const std::string& name, const std::filesystem::path& folder,
                            const std::string& missing) {
  std::filesystem::path searched = folder;
  if (searched.empty()) {
    const std::filesystem::path program = FolderOfProgram();
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
  if (opened.cpp_table == nullptr) Refuse(files.front(), "holds models alone");
  return {files.front(), opened.cpp_table};
}

}  // namespace alidade::internal
