// SPDX-License-Identifier: Apache-2.0
#include "alidade/inspect/plugin_listing.h"

#include <algorithm>
#include <tuple>
#include <utility>

#include "alidade/base/json.h"
#include "alidade/base/text_table.h"
#include "alidade/base/words.h"
#include "alidade/filter/built_in.h"
#include "alidade/host/plugin_file.h"

namespace alidade {
namespace {

using internal::EstimatorType;
using internal::EstimatorTypes;
using internal::FindEstimatorType;
using internal::Join;
using internal::Json;
using internal::KindName;
using internal::TextRow;
using internal::TextTable;

std::vector<const PluginEntry*> Sorted(const PluginHost& host) {
  std::vector<const PluginEntry*> entries;
  for (const PluginEntry& entry : host.entries()) entries.push_back(&entry);
  std::sort(entries.begin(), entries.end(), [](const PluginEntry* a, const PluginEntry* b) {
    return std::tie(a->kind, a->name, a->plugin) < std::tie(b->kind, b->name, b->plugin);
  });
  return entries;
}

/// `keys`, and those that every estimator has.
std::vector<ParamInfo> WithCommonKeys(std::vector<ParamInfo> keys) {
  const auto add = [&](const char* name, const char* type, const char* fallback, const char* doc,
                       std::vector<std::string> choices = {}) {
    keys.push_back({name, "", doc, type, "", fallback, std::move(choices), ""});
  };
  add("sensors", "list", "all", "names of those it uses, in the order of their updates");
  add("use", "choice or map", "all", "or {accepted_by: NAME}: what that filter accepted");
  add("on_divergence", "choice", "report", "fail ends the run", {"report", "fail"});
  add("overrides", "map", "none",
      "its own state, sensors, landmarks and initial_time_s, merged in");
  return keys;
}

std::vector<ParamInfo> KeysOf(const PluginHost& host, const PluginEntry& entry) {
  const std::vector<ParamInfo> keys = host.Schema(entry);
  return entry.kind == PluginEntry::Kind::kEstimator ? WithCommonKeys(keys) : keys;
}

/// The entries called `name`; there may be none for a built-in estimator only.
std::vector<const PluginEntry*> Named(const PluginHost& host, const std::string& name) {
  std::vector<const PluginEntry*> entries = Sorted(host);
  std::vector<std::string> names;
  for (const EstimatorType& type : EstimatorTypes()) names.emplace_back(type.name);
  for (const PluginEntry* entry : entries) names.push_back(entry->name);
  std::erase_if(entries, [&](const PluginEntry* entry) { return entry->name != name; });
  if (entries.empty() && FindEstimatorType(name) == nullptr) {
    throw Error(ExitCode::kPlugin, ErrorLine({}, {}, "no plugin offers '" + name + "'",
                                             "a name that `alidade plugins list` prints, or a "
                                             "type of estimator",
                                             Nearest(name, names)) +
                                       "\n" + PluginPlaces(host));
  }
  return entries;
}

std::string Parameters(const std::vector<ParamInfo>& schema) {
  std::vector<TextRow> rows = {
      {"parameter", "unit", "type", "range", "default", "only where", "meaning"}};
  for (const ParamInfo& info : schema) {
    // The keys that a source lists itself have no type.
    const std::string fallback =
        !info.fallback.empty() || info.type.empty() ? info.fallback : "required";
    const std::string range = info.choices.empty() ? info.range : Join(info.choices, " | ");
    rows.push_back({info.key, info.unit, info.type, range, fallback, info.when, info.doc});
  }
  return rows.size() > 1 ? TextTable(rows, 2) : "  no parameters\n";
}

void AddEntry(const PluginEntry& entry, Json& json) {
  json.Key("name").Text(entry.name);
  json.Key("kind").Text(KindName(entry.kind));
  json.Key("family").Text(entry.family);
  json.Key("doc").Text(entry.doc);
  json.Key("citation").Text(entry.citation);
  json.Key("file").Text(entry.plugin.string());
  json.Key("unoptimised").Flag(entry.unoptimised);
}

void AddParameter(const ParamInfo& info, Json& json) {
  json.Object();
  json.Key("key").Text(info.key);
  json.Key("unit").Text(info.unit);
  json.Key("type").Text(info.type);
  json.Key("range").Text(info.range);
  if (!info.fallback.empty()) json.Key("default").Text(info.fallback);
  json.Key("choices").Array();
  for (const std::string& choice : info.choices) json.Text(choice);
  json.End();
  json.Key("when").Text(info.when);
  json.Key("doc").Text(info.doc);
  json.End();
}

}  // namespace

std::string PluginList(const PluginHost& host, bool files) {
  std::vector<TextRow> rows = {{"name", "kind", "description", "file"}};
  for (const PluginEntry* entry : Sorted(host)) {
    rows.push_back({entry->name, KindName(entry->kind), entry->doc, entry->plugin.string()});
  }
  const std::string none = rows.size() > 1 ? "" : "\nno plugin was found\n";
  for (const EstimatorType& type : EstimatorTypes()) {
    rows.push_back({type.name, KindName(PluginEntry::Kind::kEstimator), type.doc, "built in"});
  }
  for (TextRow& row : rows) {
    if (!files) row.pop_back();
  }
  return TextTable(rows) + none;
}

std::string PluginListJson(const PluginHost& host) {
  Json json;
  json.Array();
  for (const PluginEntry* entry : Sorted(host)) {
    json.Object();
    AddEntry(*entry, json);
    json.End();
  }
  for (const EstimatorType& type : EstimatorTypes()) {
    json.Object();
    AddEntry({PluginEntry::Kind::kEstimator, type.name, type.doc, "", "", "", 0, false, false,
              type.kind},
             json);
    json.End();
  }
  json.End();
  return json.text();
}

std::string PluginInfo(const PluginHost& host, const std::string& name) {
  std::string text;
  if (const EstimatorType* type = FindEstimatorType(name)) {
    text =
        name + ": estimator\n  " + type->doc + "\n\n" + Parameters(WithCommonKeys(type->schema()));
  }
  for (const PluginEntry* entry : Named(host, name)) {
    if (!text.empty()) text += '\n';
    text += entry->name + ": " + KindName(entry->kind) + "\n  " + entry->doc + '\n';
    if (!entry->citation.empty()) text += "  source: " + entry->citation + '\n';
    text += "  plugin: " + entry->plugin.string() + '\n';
    if (entry->unoptimised) {
      text += std::string("  built without optimisation: ") + kBuildOptimised + '\n';
    }
    text += '\n';
    const std::vector<std::string> lines = host.Describe(*entry);
    for (const std::string& line : lines) text += "  " + line + '\n';
    if (!lines.empty()) text += '\n';
    text += Parameters(KeysOf(host, *entry));
  }
  return text;
}

std::string PluginInfoJson(const PluginHost& host, const std::string& name) {
  Json json;
  json.Array();
  if (const EstimatorType* type = FindEstimatorType(name)) {
    json.Object();
    json.Key("name").Text(type->name);
    json.Key("kind").Text("estimator");
    json.Key("doc").Text(type->doc);
    json.Key("parameters").Array();
    for (const ParamInfo& info : WithCommonKeys(type->schema())) AddParameter(info, json);
    json.End();
    json.End();
  }
  for (const PluginEntry* entry : Named(host, name)) {
    json.Object();
    AddEntry(*entry, json);
    json.Key("describes").Array();
    for (const std::string& line : host.Describe(*entry)) json.Text(line);
    json.End();
    json.Key("parameters").Array();
    for (const ParamInfo& info : KeysOf(host, *entry)) AddParameter(info, json);
    json.End();
    json.End();
  }
  json.End();
  return json.text();
}

}  // namespace alidade
