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

/// One parameter of a model, as declared by being read.
struct ParamInfo {
  std::string key, unit, doc;
  std::string type;                  ///< number, integer, flag, choice, or `number[3]`
  std::string range;                 ///< `> 0`, `[1, 3]`, or "" if everything is allowed
  std::string fallback;              ///< the default as text, "" if the key is required
  std::vector<std::string> choices;  ///< of a choice
  std::string when;  ///< `noise_model = constant` if only that choice reads it, else ""
};

/// The kinds of models; those of C++ plugins are named by the headers of their interfaces.
inline constexpr const char* kSensorKind = "sensor";
inline constexpr const char* kMotionKind = "motion model";

/// A model, or a factory of a C++ plugin, that a loaded plugin offers.
struct PluginEntry {
  std::string kind;  ///< kSensorKind, kMotionKind, or that of the factory
  std::string name, doc, citation, family;
  std::filesystem::path plugin;   ///< the file it came from
  unsigned thread_flags = 0;      ///< ALIDADE_THREAD_*; of a factory 0
  std::string keys = {};          ///< of a factory: CppEntry::keys
  const void* factory = nullptr;  ///< CppEntry::factory; of a model null
  AlidadeEntry model = {};        ///< of a model, as its table has it

  bool is_model() const { return factory == nullptr; }
};

/// Why a file in a searched folder was not loaded.
struct Refusal {
  std::filesystem::path file;
  std::string reason;
  ExitCode code;
};

/// What becomes of a given file or folder that is missing or refused: an error, or an entry of
/// PluginHost::searched() and refusals().
enum class OnRefusal { kThrow, kList };

/// Finds and loads plugins. A file is opened only if CheckTrusted accepts it and its build tag,
/// read from the bytes beforehand, fits this program. Plugins are never unloaded. Const members may
/// be called from several threads.
class PluginHost {
 public:
  /// Searches, in this order: `files_and_folders` (config `plugins:`, then `--plugin-path`),
  /// ALIDADE_PLUGIN_PATH, the user data folder, the folder beside this library. What is refused
  /// elsewhere than in `files_and_folders` is always listed. Errors: kPlugin, kNotTrusted.
  /// `only`, if set, has every name that will be asked for: plugins elsewhere that list none of
  /// them stay closed, which saves the time of opening them. Then an error about a name that is not
  /// found opens all, which is for one thread.
  explicit PluginHost(const std::vector<std::filesystem::path>& files_and_folders = {},
                      OnRefusal on_refusal = OnRefusal::kThrow,
                      const std::optional<std::set<std::string>>& only = {});

  /// The model of that name, made by CreateModel. Errors: those of Find and of CreateModel.
  SharedSensor CreateSensor(const std::string& name, const Node& entry,
                            const std::string& representation = {}) const;
  SharedMotion CreateMotion(const std::string& name, const Node& entry) const;
  /// The only entry of that kind and name, which `node` asks for. Errors: kPlugin with the places
  /// searched if there is none, and if there are two.
  const PluginEntry& Find(const std::string& kind, const std::string& name, const Node& node) const;

  /// Whether no plugin was left closed for its names.
  bool complete() const { return !only_; }
  /// One that has opened all: for errors, which tell what there is.
  PluginHost Complete() const;

  const std::vector<PluginEntry>& entries() const { return entries_; }
  /// Every place looked at, in order, with what was found there in the plugins that were opened.
  const std::vector<std::string>& searched() const { return searched_; }
  const std::vector<Refusal>& refusals() const { return refusals_; }

 private:
  void LoadPlace(const std::filesystem::path& place, const std::string& origin, bool required);
  void LoadFolder(const std::filesystem::path& folder, bool required, bool whole);
  void LoadFile(const std::filesystem::path& file, bool required);
  void Load(const std::filesystem::path& file);
  [[noreturn]] void FailMissing(const std::string& kind, const std::string& name,
                                const Node& node) const;

  std::vector<std::filesystem::path> given_;
  std::optional<std::set<std::string>> only_;
  std::vector<std::filesystem::path> loaded_;  ///< canonical
  std::vector<PluginEntry> entries_;
  std::vector<std::string> searched_;
  std::vector<Refusal> refusals_;
};

/// Every place searched and what was found there, and every file refused with the reason.
std::string PluginPlaces(const PluginHost& host);

}  // namespace alidade
