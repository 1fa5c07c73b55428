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

/// Parameter of a model. The model declares the parameter by reading it.
struct ParamInfo {
  std::string key, unit, doc;
  std::string type;                  ///< number, integer, flag, choice, or `number[3]`
  std::string range;                 ///< `> 0`, `[1, 3]`, or "" if every value is allowed
  std::string fallback;              ///< the default as text, "" if the key is required
  std::vector<std::string> choices;  ///< names of the values, if the type is `choice`
  /// `noise_model = constant` if the model reads the parameter only with that choice; else "".
  std::string condition;
};

/// Kinds of models. The headers of the interfaces define the kinds of C++ plugins.
inline constexpr const char* kSensorKind = "sensor";
inline constexpr const char* kMotionKind = "motion model";

/// Entry of a loaded plugin: a model, or a factory of a C++ plugin.
struct PluginEntry {
  std::string kind;  ///< kSensorKind, kMotionKind, or the kind of the factory
  std::string name, doc, citation, family;
  std::filesystem::path plugin;   ///< file of the plugin
  unsigned thread_flags = 0;      ///< ALIDADE_THREAD_*; 0 for a factory
  std::string keys = {};          ///< CppEntry::keys; empty for a model
  const void* factory = nullptr;  ///< CppEntry::factory; null for a model
  AlidadeEntry model = {};        ///< entry in the plugin's table; empty for a factory

  bool is_model() const { return factory == nullptr; }
};

/// Refused file of a searched folder, with the reason for the refusal.
struct Refusal {
  std::filesystem::path file;
  std::string reason;
  ExitCode code;
};

/// Reaction to a configured file or folder that is missing or refused: an error, or an entry of
/// PluginHost::searched() and refusals().
enum class OnRefusal { kThrow, kList };

/// Host of plugins: finds plugins and loads them. It loads a file only if CheckTrusted accepts the
/// file and the build tag of the file is compatible with this program. The host reads the build tag
/// without loading the file. Plugins are never unloaded. Const members are thread-safe.
class PluginHost {
 public:
  /// Searches, in this order: `files_and_folders` (config `plugins:`, then `--plugin-path`),
  /// ALIDADE_PLUGIN_PATH, the user data folder, the folder next to this library. `on_refusal`
  /// applies to `files_and_folders`; refusals in other places are always listed. Errors: kPlugin,
  /// kNotTrusted.
  ///
  /// If `requested_names` is set, it must contain every name that will be requested. To save time,
  /// the host then does not load plugins outside `files_and_folders` that list none of these names.
  /// If Find does not find a name, its error message requires all plugins: loading them is not
  /// thread-safe.
  explicit PluginHost(const std::vector<std::filesystem::path>& files_and_folders = {},
                      OnRefusal on_refusal = OnRefusal::kThrow,
                      const std::optional<std::set<std::string>>& requested_names = {});

  /// Creates the model with that name by CreateModel. Errors: those of Find and of CreateModel.
  SharedSensor CreateSensor(const std::string& name, const Node& entry,
                            const std::string& representation = {}) const;
  SharedMotion CreateMotion(const std::string& name, const Node& entry) const;
  /// Returns the only entry with that kind and name. `node` is the node of the config that requests
  /// the entry. Errors: kPlugin, with the searched places, if no plugin or more than one plugin
  /// offers such an entry.
  const PluginEntry& Find(const std::string& kind, const std::string& name, const Node& node) const;

  /// Returns false if plugins may have been skipped because of `requested_names`.
  bool has_all_plugins() const { return !requested_names_; }
  /// Returns a host that has loaded all plugins. Error messages list the available entries of this
  /// host.
  PluginHost WithAllPlugins() const;

  const std::vector<PluginEntry>& entries() const { return entries_; }
  /// Returns every searched place, in the order of the search. Each text includes the number of
  /// entries that were found there.
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
  std::vector<std::filesystem::path> loaded_;  ///< paths of loaded plugins, without symbolic links
  std::vector<PluginEntry> entries_;
  std::vector<std::string> searched_;
  std::vector<Refusal> refusals_;
};

/// Returns a text that lists every searched place with its result, and every refused file with the
/// reason.
std::string PluginPlaces(const PluginHost& host);

}  // namespace alidade
