// SPDX-License-Identifier: Apache-2.0
#include "alidade/plugin/plugin_host.h"

#include <algorithm>
#include <optional>
#include <set>

#include "alidade/base/text.h"
#include "alidade/io/log.h"
#include "alidade/plugin/abi_read.h"
#include "alidade/plugin/built_in_models.h"
#include "alidade/plugin/cpp_plugin.h"
#include "alidade/plugin/create.h"
#include "alidade/plugin/load.h"
#include "alidade/plugin/plugin_folders.h"
#include "alidade/plugin/plugin_models.h"
#include "alidade/plugin/plugin_sections.h"
#include "alidade/plugin/table_defect.h"
#include "alidade/plugin/trust.h"

namespace alidade {
namespace fs = std::filesystem;
namespace {

using internal::Join;
using internal::Refuse;
using internal::Text;
using internal::WithArticle;

/// Origin of places that the config or the command line specifies.
constexpr const char* kGiven = "config or command line";

const char* ToKind(std::uint32_t kind) {
  return kind == ALIDADE_KIND_SENSOR ? kSensorKind : kMotionKind;
}

/// Appends the entries of the plugin to `entries`, and those of an unknown kind to `refusals`.
void AddEntries(const internal::LoadedPlugin& plugin, std::vector<PluginEntry>& entries,
                std::vector<Refusal>& refusals) {
  if (plugin.cpp_table != nullptr) {
    for (int i = 0; i < plugin.cpp_table->entry_count; ++i) {
      const CppEntry& entry = plugin.cpp_table->entries[i];
      entries.push_back({entry.kind, entry.name, Text(entry.doc), Text(entry.citation), "",
                         plugin.file, 0, Text(entry.keys), entry.factory});
    }
    return;
  }
  const AlidadeTable table = internal::ReadPrefix(plugin.table);
  for (std::uint32_t i = 0; i < table.entry_count; ++i) {
    const AlidadeEntry entry = internal::ReadEntry(table.entries, table.entry_stride, i);
    if (!internal::IsKnown(entry)) {
      refusals.push_back({plugin.file,
                          std::string("its entry '") + entry.name + "' is of kind " +
                              std::to_string(entry.kind) +
                              ", which this version does not know; the other entries are used",
                          ExitCode::kPlugin});
      continue;
    }
    entries.push_back({ToKind(entry.kind), entry.name, Text(entry.doc), Text(entry.citation),
                       Text(entry.family), plugin.file, entry.thread_flags, "", nullptr, entry});
  }
}

}  // namespace

PluginHost::PluginHost(const std::vector<fs::path>& files_and_folders, OnRefusal on_refusal,
                       const std::optional<std::set<std::string>>& requested_names)
    : configured_places_(files_and_folders), requested_names_(requested_names) {
  const bool is_required = on_refusal == OnRefusal::kThrow;
  for (const fs::path& place : files_and_folders) LoadPlace(place, kGiven, is_required);
  for (const fs::path& folder : internal::PluginFoldersOfEnvironment()) {
    LoadPlace(folder, "ALIDADE_PLUGIN_PATH", false);
  }
  if (const auto folder = internal::PluginFolderOfUser())
    LoadPlace(*folder, "user data folder", false);
  const fs::path library_folder = internal::FolderOfLibrary();
  if (!library_folder.empty()) LoadPlace(library_folder / "plugins", "next to the program", false);
}

PluginHost PluginHost::WithAllPlugins() const {
  return PluginHost(configured_places_, OnRefusal::kList);
}

void PluginHost::LoadPlace(const fs::path& place, const std::string& origin, bool is_required) {
  const std::size_t entries = entries_.size(), refusals = refusals_.size();
  std::error_code error;
  const bool exists = fs::exists(place, error);
  if (!exists && is_required) {
    if (!place.is_absolute()) CheckTrusted(place);
    Refuse(place, "no such file or folder");
  }
  if (fs::is_directory(place, error)) {
    LoadFolder(place, is_required, origin == kGiven);
  } else if (exists) {
    LoadFile(place, is_required);
  }
  std::string result = "does not exist";
  if (exists) {
    const std::size_t found = entries_.size() - entries;
    result = std::to_string(found) + (found == 1 ? " entry found" : " entries found");
    if (refusals_.size() > refusals) {
      result += ", " + std::to_string(refusals_.size() - refusals) + " refused";
    }
  }
  searched_.push_back(place.string() + " (" + origin + "): " + result);
}

/// Loads the plugins in `folder`. If `loads_all` is false, skips plugins that offer none of the
/// requested names.
void PluginHost::LoadFolder(const fs::path& folder, bool is_required, bool loads_all) {
  std::set<fs::path> files;
  std::error_code error;
  for (fs::directory_iterator iterator(folder, error), end; !error && iterator != end;
       iterator.increment(error)) {
    if (iterator->path().extension() != ".so") continue;
    if (loads_all || !requested_names_ || internal::MayOffer(iterator->path(), *requested_names_))
      files.insert(iterator->path());
  }
  if (error) {
    if (is_required) Refuse(folder, error.message());
    refusals_.push_back({folder, error.message(), ExitCode::kPlugin});
  }
  for (const fs::path& file : files) LoadFile(file, is_required);
}

void PluginHost::LoadFile(const fs::path& file, bool is_required) {
  try {
    Load(file);
  } catch (const Error& e) {
    if (is_required) throw;
    const std::string prefix = file.string() + ": ";
    std::string reason = e.what();
    if (reason.starts_with(prefix)) reason.erase(0, prefix.size());
    refusals_.push_back({file, reason, e.code()});
    if (IsLogged(LogLevel::kInfo)) {
      Log(LogLevel::kInfo, "plugin refused: " + file.string() + ": " + reason);
    }
  }
}

void PluginHost::Load(const fs::path& file) {
  if (!file.is_absolute()) CheckTrusted(file);
  std::error_code error;
  const fs::path canonical = fs::canonical(file, error);
  if (error) Refuse(file, error.message());
  const auto is_same = [&](const fs::path& loaded) {
    return loaded == canonical || fs::equivalent(loaded, canonical, error);
  };
  if (std::any_of(loaded_.begin(), loaded_.end(), is_same)) return;
  const internal::LoadedPlugin plugin = internal::LoadPlugin(file, canonical);
  loaded_.push_back(canonical);
  const std::size_t first = entries_.size();
  AddEntries(plugin, entries_, refusals_);
  if (!IsLogged(LogLevel::kDebug)) return;
  std::string names;
  for (std::size_t i = first; i < entries_.size(); ++i) {
    names += (i > first ? ", " : "") + entries_[i].name;
  }
  Log(LogLevel::kDebug, "plugin loaded: " + canonical.string() + ": " + names);
}

const PluginEntry& PluginHost::Find(const std::string& kind, const std::string& name,
                                    const Node& node) const {
  const auto matches = [&](const PluginEntry& e) { return e.kind == kind && e.name == name; };
  const auto entry = std::find_if(entries_.begin(), entries_.end(), matches);
  if (entry == entries_.end()) FailMissing(kind, name, node);
  const auto second_entry = std::find_if(entry + 1, entries_.end(), matches);
  if (second_entry != entries_.end()) {
    throw Error(
        ExitCode::kPlugin,
        ErrorLine(node.place(), node.path(),
                  "two plugins offer the " + kind + " '" + name + "': " + entry->plugin.string() +
                      " and " + second_entry->plugin.string() + "; remove one of them"));
  }
  return *entry;
}

void PluginHost::FailMissing(const std::string& kind, const std::string& name,
                             const Node& node) const {
  if (!has_all_plugins()) WithAllPlugins().FailMissing(kind, name, node);
  const char* const key = kind == kSensorKind || kind == kMotionKind ? "model" : "type";
  const Node location = node.is_map() ? node.Find(key).value_or(node) : node;
  std::string problem = "no plugin offers the " + kind + " '" + name + "'";
  std::vector<std::string> names;
  for (const PluginEntry& entry : entries_) {
    if (entry.kind == kind && entry.name == name) {
      throw Error(ExitCode::kPlugin,
                  ErrorLine(location.place(), location.path(),
                            "the " + kind + " '" + name + "' of " + entry.plugin.string() +
                                " was requested, but the config does not contain its name, so the "
                                "plugin was not loaded",
                            "its name in the config, or the plugin in `plugins:`"));
    }
    if (entry.kind == kind) names.push_back(entry.name);
    if (entry.name == name) problem += "; there is " + WithArticle(entry.kind) + " with this name";
  }
  for (const internal::BuiltInModel& model : internal::kBuiltInModels) {
    if (kind == kSensorKind || kind == kMotionKind) names.emplace_back(model.name);
  }
  ExitCode code = ExitCode::kPlugin;
  for (const Refusal& refusal : refusals_) {
    if (refusal.code == ExitCode::kNotTrusted && code != ExitCode::kNotTrusted) {
      code = ExitCode::kNotTrusted;
      problem += "; '" + refusal.file.string() + "' was refused because it is not trusted";
    }
  }
  const std::string nearest = Nearest(name, names);
  std::ranges::sort(names);
  std::string expected = (names.size() > 1 ? "one of " : "") + Join(names);
  std::string places = PluginPlaces(*this);
  if (!places.empty()) places.insert(0, "\n").pop_back();
  if (!nearest.empty()) {
    expected.clear();
    if (refusals_.empty()) places.clear();
  }
  throw Error(code,
              ErrorLine(location.place(), location.path(), problem, expected, nearest) + places);
}

SharedSensor PluginHost::CreateSensor(
    const std::string& name, const Node& entry, const std::string& representation,
    const std::map<std::string, std::string>& bound_geometries) const {
  return std::make_shared<PluginSensor>(
      CreateModel(Find(kSensorKind, name, entry), entry, representation, bound_geometries));
}

SharedMotion PluginHost::CreateMotion(const std::string& name, const Node& entry) const {
  return std::make_shared<PluginMotion>(CreateModel(Find(kMotionKind, name, entry), entry));
}

std::string PluginPlaces(const PluginHost& host) {
  std::string text;
  for (const std::string& place : host.searched()) text += "  searched " + place + '\n';
  for (const Refusal& refusal : host.refusals()) {
    text += "  refused " + refusal.file.string() + ": " + refusal.reason + '\n';
  }
  return text;
}

}  // namespace alidade
