// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "alidade/experiment/source.h"
#include "alidade/plugin/cpp_plugin.h"
#include "alidade/plugin/plugin_host.h"

/// Sources that C++ plugins provide.
namespace alidade {

inline constexpr const char* kSourceKind = "source";

/// Factory of a source.
struct SourceEntry {
  const char* name;
  const char* doc;
  /// Keys that the source does not read through Params. Each line has the form `key  meaning`.
  const char* keys;
  std::unique_ptr<Source> (*create)(const SourceArguments& arguments);
};
constexpr CppEntry EntryOf(const SourceEntry& source) {
  return {kSourceKind, source.name, source.doc, "", source.keys, &source};
}

/// Creates the source that the map `source` of a config describes. SourceArguments describes
/// `any_order`. Errors: kPlugin with the searched places, kBadConfig, and those of the source.
std::unique_ptr<Source> CreateSource(const PluginHost& host, const Config& config,
                                     std::uint64_t seed, bool any_order = false);

/// Returns the parameters of the source `entry`.
std::vector<ParamInfo> SourceSchema(const PluginEntry& entry);

}  // namespace alidade

/// Exports the sources of this plugin: ALIDADE_SOURCE_PLUGIN({"name", "doc", "keys", &Create}, ...)
#define ALIDADE_SOURCE_PLUGIN(...) ALIDADE_CPP_PLUGIN(alidade::SourceEntry, __VA_ARGS__)
