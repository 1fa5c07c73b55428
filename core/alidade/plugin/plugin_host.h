// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "alidade/config/config.h"
#include "alidade/estimation/models.h"
#include "alidade/model/plugin_abi.h"

namespace alidade {

/// Parameter of a model, which the model declares when it reads it.
struct ParamInfo {
  std::string key, unit, doc;
  std::string type;                  ///< number, integer, flag, choice, or `number[3]`
  std::string range;                 ///< `> 0`, `[1, 3]`, or "" if everything is allowed
  std::string fallback;              ///< the default as text, "" if the key is required
  std::vector<std::string> choices;  ///< of a choice
  std::string condition;  ///< `noise_model = constant` if only that choice reads it, else ""
};

/// Kinds of models. The headers of the interfaces define the kinds of C++ plugins.
inline constexpr const char* kSensorKind = "sensor";
inline constexpr const char* kMotionKind = "motion model";

/// Entry of a loaded plugin: a model, or a factory of a C++ plugin.
struct PluginEntry {
  std::string kind;  ///< kSensorKind, kMotionKind, or that of the factory
  std::string name, doc, citation, family;
  std::filesystem::path plugin;   ///< file of the plugin
  unsigned thread_flags = 0;      ///< ALIDADE_THREAD_*; 0 for a factory
  std::string keys = {};          ///< of a factory: CppEntry::keys
  const void* factory = nullptr;  ///< CppEntry::factory; null for a model
  AlidadeEntry model = {};        ///< of a model: the entry of its table

  bool is_model() const { return factory == nullptr; }
};

/// Refused file of a searched folder, with the reason.
struct Refusal {
  std::filesystem::path file;
  std::string reason;
  ExitCode code;
};

/// Reaction to a configured file or folder that is missing or refused: an error, or an entry of
/// PluginHost::searched() and refusals().
enum class OnRefusal { kThrow, kList };

/// Host of plugins: finds and loads them. It loads a file only if CheckTrusted accepts the file and
/// its build tag is compatible with this program. The build tag is read without loading the file.
/// Plugins are never unloaded. Const members are thread-safe.
class PluginHost {
 public:
  /// Searches, in this order: `files_and_folders` (config `plugins:`, then `--plugin-path`),
  /// ALIDADE_PLUGIN_PATH, the user data folder, the folder next to this library. `on_refusal`
  /// applies to `files_and_folders`; refusals in other places are always listed. Errors: kPlugin,
  /// kNotTrusted.
  ///
  /// `requested_names`, if set, contains every name that will be requested. To save time, plugins
  /// outside `files_and_folders` are then not loaded if they list none of these names. Reporting a
  /// name that is not found then loads all plugins, which is not thread-safe.
  explicit PluginHost(const std::vector<std::filesystem::path>& files_and_folders = {},
                      OnRefusal on_refusal = OnRefusal::kThrow,
                      const std::optional<std::set<std::string>>& requested_names = {});

  /// Creates the model of that name by CreateModel. Errors: those of Find and of CreateModel.
  SharedSensor CreateSensor(const std::string& name, const Node& entry,
                            const std::string& representation = {}) const;
  SharedMotion CreateMotion(const std::string& name, const Node& entry) const;
  /// Returns the only entry of that kind and name, which `node` requests. Errors: kPlugin, with the
  /// searched places, if no plugin or more than one plugin offers it.
  const PluginEntry& Find(const std::string& kind, const std::string& name, const Node& node) const;

  /// Returns false if plugins may have been skipped because of `requested_names`.
  bool has_all_plugins() const { return !requested_names_; }
  /// Returns a host that has loaded all plugins. Errors use it to list the available entries.
  PluginHost WithAllPlugins() const;

  const std::vector<PluginEntry>& entries() const { return entries_; }
  /// Returns every searched place, in order, with the number of entries found in loaded plugins.
  const std::vector<std::string>& searched() const { return searched_; }
  const std::vector<Refusal>& refusals() const { return refusals_; }

 private:
  void LoadPlace(const std::filesystem::path& place, const std::string& origin, bool is_required);
  void LoadFolder(const std::filesystem::path& folder, bool is_required, bool loads_all);
  void LoadFile(const std::filesystem::path& file, bool is_required);
  void Load(const std::filesystem::path& file);
  [[noreturn]] void FailMissing(const std::string& kind, const std::string& name,
                                const Node& node) const;

  std::vector<std::filesystem::path> configured_places_;
  std::optional<std::set<std::string>> requested_names_;
  std::vector<std::filesystem::path> loaded_;  ///< canonical
  std::vector<PluginEntry> entries_;
  std::vector<std::string> searched_;
  std::vector<Refusal> refusals_;
};

/// Returns a text that lists every searched place with its result, and every refused file with the
/// reason.
std::string PluginPlaces(const PluginHost& host);

}  // namespace alidade
