// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "alidade/model/build_tag.h"

/// Table of a C++ plugin. Such a plugin is built against alidade::core. The header of each
/// interface defines the macro that exports implementations of the interface.
namespace alidade {

/// ABI number of C++ plugins. A plugin is loaded only if its number equals the number of the
/// library, because the two share classes. Increase the number with each change of the layout or
/// meaning of an installed class or function. The second definition is necessary because the
/// classes of a debug standard library have a different layout.
#if defined(_GLIBCXX_DEBUG)
#define ALIDADE_CPP_ABI "4 with _GLIBCXX_DEBUG"
#else
#define ALIDADE_CPP_ABI "4"
#endif

/// Implementation of an interface by a plugin. The loader does not know the type of `factory`. The
/// code that requests an implementation of this kind casts the pointer to the correct type.
struct CppEntry {
  const char* kind;  ///< name of the interface, such as `source`; appears in messages
  const char* name;
  const char* doc;
  const char* citation;
  /// Keys that are not read through Params. Each line has the form `key  meaning`.
  const char* keys;
  const void* factory;  ///< pointer to the type that the header of the interface defines
};

/// Table that a C++ plugin exports.
struct CppPluginTable {
  std::uint32_t struct_size = sizeof(CppPluginTable);
  const CppEntry* entries = nullptr;
  int entry_count = 0;
};

inline constexpr const char* kCppEntrySymbol = "alidade_cpp_plugin";

template <std::size_t N>
struct CppEntries {
  CppEntry entries[N];
};
/// Returns the entries of the factories. EntryOf(factory) must return the entry of one factory.
template <class Factory, std::size_t N>
constexpr CppEntries<N> EntriesOf(const Factory (&factories)[N]) {
  CppEntries<N> result{};
  for (std::size_t i = 0; i < N; ++i) result.entries[i] = EntryOf(factories[i]);
  return result;
}

}  // namespace alidade

/// Exports factories of the type `Factory`. Each further argument is the initialiser of one
/// factory, in braces.
#define ALIDADE_CPP_PLUGIN(Factory, ...)                                           \
  static constexpr Factory alidade_factories[] = {__VA_ARGS__};                    \
  static constexpr auto alidade_offers = alidade::EntriesOf(alidade_factories);    \
  ALIDADE_ENTRY_NAMES(alidade_offers.entries)                                      \
  ALIDADE_BUILD_TAG(ALIDADE_PLUGIN_CPP, ALIDADE_CPP_ABI)                           \
  extern "C" __attribute__((visibility("default"))) const alidade::CppPluginTable* \
  alidade_cpp_plugin() {                                                           \
    static constexpr alidade::CppPluginTable table = {                             \
        sizeof(alidade::CppPluginTable), alidade_offers.entries,                   \
        sizeof(alidade_offers.entries) / sizeof(alidade::CppEntry)};               \
    return &table;                                                                 \
  }
