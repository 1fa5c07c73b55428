// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
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
  std::string fallback;              ///< the default as text; "" if the key is required
  std::vector<std::string> choices;  ///< names of the values, if the type is `choice`
  /// Condition on which the model reads the parameter, such as `noise_model = constant`; "" if the
  /// model always reads it.
  std::string condition;
};

/// Kinds of models. The kinds of C++ plugins are defined in the headers of their interfaces.
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

/// File or folder that the host refused, with the reason.
struct Refusal {
  std::filesystem::path file;
  std::string reason;
  ExitCode code;
};

/// Reaction to a configured file or folder that is missing or refused. kThrow throws an error.
/// kList adds an entry to PluginHost::searched() and PluginHost::refusals().
enum class OnRefusal { kThrow, kList };

/// Host of plugins: finds and loads plugins. It loads a file only if CheckTrusted accepts the file
/// and the build tag of the file is compatible with this program. The host reads the build tag
/// before it loads the file. Plugins are never unloaded. Const members are thread-safe.
class PluginHost {
 public:
  /// Searches these places in this order: `files_and_folders` (`plugins` of the config, then
  /// `--plugin-path`), ALIDADE_PLUGIN_PATH, the user data folder, the folder next to this library.
  /// `on_refusal` applies to `files_and_folders`; refusals in the other places are always listed.
  /// Errors: kPlugin, kNotTrusted.
  ///
  /// If `requested_names` is set, it must contain every name that will be requested. To save time,
  /// the host then skips each plugin outside `files_and_folders` whose list of names contains none
  /// of these names. If Find fails, it loads all plugins to compose the error message. Such a call
  /// is not thread-safe.
  explicit PluginHost(const std::vector<std::filesystem::path>& files_and_folders = {},
                      OnRefusal on_refusal = OnRefusal::kThrow,
                      const std::optional<std::set<std::string>>& requested_names = {});

  /// Creates the model `name` by CreateModel. Errors: the errors of Find and CreateModel.
  SharedSensor CreateSensor(const std::string& name, const Node& entry,
                            const std::string& representation = {},
                            const std::map<std::string, std::string>& bound_geometries = {}) const;
  SharedMotion CreateMotion(const std::string& name, const Node& entry) const;
  /// Returns the only entry with this kind and name. `node` is the node of the config that requests
  /// the entry. Errors: kPlugin if no plugin or more than one plugin offers such an entry;
  /// kNotTrusted if no plugin offers such an entry and a file was refused because it is not
  /// trusted.
  const PluginEntry& Find(const std::string& kind, const std::string& name, const Node& node) const;

  /// Returns false if plugins may have been skipped because of `requested_names`.
  bool has_all_plugins() const { return !requested_names_; }
  /// Returns a host that has loaded all plugins. Error messages use this host to list all available
  /// entries.
  PluginHost WithAllPlugins() const;

  const std::vector<PluginEntry>& entries() const { return entries_; }
  /// Returns a text for every searched place, in the order of the search. Each text contains the
  /// place and the number of entries that were found there.
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
