// SPDX-License-Identifier: Apache-2.0
#include <dlfcn.h>

#include "alidade/base/child_process.h"
#include "alidade/host/build_plugin.h"
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

/// In the child.
std::string Try(const std::filesystem::path& file, std::uint32_t kind) {
  const Surroundings before;
  void* const library = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr) return "cannot be loaded: " + DlError();
  const std::string change = Surroundings().ChangeSince(before);
  if (!change.empty()) return change + " while loading";
  if (kind == ALIDADE_PLUGIN_CPP) return WalkTable<BuildTable>(library, kBuildEntrySymbol);
  const std::string defect = WalkTable<AlidadeTable>(library, ALIDADE_ENTRY_SYMBOL);
  // The destructors of its statics run when the host ends; a crash is better found here.
  dlclose(library);
  return defect;
}

}  // namespace

std::string TrialLoad(const std::filesystem::path& file, std::uint32_t kind) {
  const SharedJournal journal;
  const ChildEnd end = RunInChild({kTimeLimit_s, 0}, *journal, [&]() -> std::string {
    try {
      return Try(file, kind);
    } catch (...) {
      return "threw an exception while loading";
    }
  });
  return end.answered ? end.text : end.text + " while loading";
}

}  // namespace alidade::internal
