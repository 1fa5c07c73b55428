// SPDX-License-Identifier: Apache-2.0
#include "alidade/plugin/plugin_host.h"

#include <algorithm>
#include <optional>
#include <set>

#include "alidade/base/text.h"
#include "alidade/io/log.h"
#include "alidade/plugin/abi_read.h"
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

using internal::Refuse;
using internal::Text;
using internal::WithArticle;

/// The origin of places that are given.
constexpr const char* kGiven = "given";

const char* ToKind(std::uint32_t kind) {
  return kind == ALIDADE_KIND_SENSOR ? kSensorKind : kMotionKind;
}

/// Appends the entries of the plugin, and those of an unknown kind to the refusals.
void AddEntries(const internal::OpenedPlugin& plugin, std::vector<PluginEntry>& entries,
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
                              ", which this version does not know; the others are used",
                          ExitCode::kPlugin});
      continue;
    }
    entries.push_back({ToKind(entry.kind), entry.name, Text(entry.doc), Text(entry.citation),
                       Text(entry.family), plugin.file, entry.thread_flags, "", nullptr, entry});
  }
}

}  // namespace

PluginHost::PluginHost(const std::vector<fs::path>& files_and_folders, OnRefusal on_refusal,
                       const std::optional<std::set<std::string>>& only)
    : given_(files_and_folders), only_(only) {
  const bool required = on_refusal == OnRefusal::kThrow;
  for (const fs::path& place : files_and_folders) LoadPlace(place, kGiven, required);
  for (const fs::path& folder : internal::PluginFoldersOfEnvironment()) {
    LoadPlace(folder, "ALIDADE_PLUGIN_PATH", false);
  }
  if (const auto folder = internal::PluginFolderOfUser())
    LoadPlace(*folder, "user data folder", false);
  const fs::path own = internal::FolderOfLibrary();
  if (!own.empty()) LoadPlace(own / "plugins", "next to the program", false);
}

PluginHost PluginHost::Complete() const { return PluginHost(given_, OnRefusal::kList); }

void PluginHost::LoadPlace(const fs::path& place, const std::string& origin, bool required) {
  const std::size_t entries = entries_.size(), refusals = refusals_.size();
  std::error_code error;
  const bool there = fs::exists(place, error);
  if (!there && required) {
    if (!place.is_absolute()) CheckTrusted(place);
    Refuse(place, "no such file or folder");
  }
  if (fs::is_directory(place, error)) {
    LoadFolder(place, required, origin == kGiven);
  } else if (there) {
    LoadFile(place, required);
  }
  std::string found = "not there";
  if (there) {
    found = std::to_string(entries_.size() - entries) + " found";
    if (refusals_.size() > refusals) {
      found += ", " + std::to_string(refusals_.size() - refusals) + " refused";
    }
  }
  searched_.push_back(place.string() + " (" + origin + "): " + found);
}

/// `whole`: whatever its plugins offer.
void PluginHost::LoadFolder(const fs::path& folder, bool required, bool whole) {
  std::set<fs::path> files;
  std::error_code error;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    if (at->path().extension() != ".so") continue;
    if (whole || !only_ || internal::MayOffer(at->path(), *only_)) files.insert(at->path());
  }
  if (error) {
    if (required) Refuse(folder, error.message());
    refusals_.push_back({folder, error.message(), ExitCode::kPlugin});
  }
  for (const fs::path& file : files) LoadFile(file, required);
}

void PluginHost::LoadFile(const fs::path& file, bool required) {
  try {
    Load(file);
  } catch (const Error& e) {
    if (required) throw;
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
  const auto same = [&](const fs::path& other) {
    return other == canonical || fs::equivalent(other, canonical, error);
  };
  if (std::any_of(loaded_.begin(), loaded_.end(), same)) return;
  const internal::OpenedPlugin plugin = internal::OpenPlugin(file, canonical);
  loaded_.push_back(canonical);
  const std::size_t before = entries_.size();
  AddEntries(plugin, entries_, refusals_);
  if (!IsLogged(LogLevel::kDebug)) return;
  std::string names;
  for (std::size_t i = before; i < entries_.size(); ++i) {
    names += (i > before ? ", " : "") + entries_[i].name;
  }
  Log(LogLevel::kDebug, "plugin loaded: " + canonical.string() + ": " + names);
}

const PluginEntry& PluginHost::Find(const std::string& kind, const std::string& name,
                                    const Node& node) const {
  const auto matches = [&](const PluginEntry& e) { return e.kind == kind && e.name == name; };
  const auto found = std::find_if(entries_.begin(), entries_.end(), matches);
  if (found == entries_.end()) FailMissing(kind, name, node);
  const auto other = std::find_if(found + 1, entries_.end(), matches);
  if (other != entries_.end()) {
    throw Error(ExitCode::kPlugin, ErrorLine(node.place(), node.path(),
                                             "two plugins offer the " + kind + " '" + name +
                                                 "': " + found->plugin.string() + " and " +
                                                 other->plugin.string() + "; remove one of them"));
  }
  return *found;
}

void PluginHost::FailMissing(const std::string& kind, const std::string& name,
                             const Node& node) const {
  if (!complete()) Complete().FailMissing(kind, name, node);
  const char* const key = kind == kSensorKind || kind == kMotionKind ? "model" : "type";
  const Node at = node.is_map() ? node.Find(key).value_or(node) : node;
  std::string what = "no plugin offers the " + kind + " '" + name + "'";
  std::vector<std::string> names;
  for (const PluginEntry& other : entries_) {
    if (other.kind == kind && other.name == name) {
      throw Error(ExitCode::kPlugin,
                  ErrorLine(at.place(), at.path(),
                            "the " + kind + " '" + name + "' of " + other.plugin.string() +
                                " is asked for, but not named in the config, so that the plugin "
                                "was not opened",
                            "its name in the config, or the plugin in `plugins:`"));
    }
    if (other.kind == kind) names.push_back(other.name);
    if (other.name == name) what += "; there is " + WithArticle(other.kind) + " of that name";
  }
  ExitCode code = ExitCode::kPlugin;
  for (const Refusal& refusal : refusals_) {
    if (refusal.code == ExitCode::kNotTrusted && code != ExitCode::kNotTrusted) {
      code = ExitCode::kNotTrusted;
      what += "; '" + refusal.file.string() + "' was refused because it is not trusted";
    }
  }
  std::string places = PluginPlaces(*this);
  if (!places.empty()) places.insert(0, "\n").pop_back();
  throw Error(code, ErrorLine(at.place(), at.path(), what, {}, Nearest(name, names)) + places);
}

SharedSensor PluginHost::CreateSensor(const std::string& name, const Node& entry,
                                      const std::string& representation) const {
  return std::make_shared<PluginSensor>(
      CreateModel(Find(kSensorKind, name, entry), entry, representation));
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
