// SPDX-License-Identifier: Apache-2.0
#include "alidade/check/plugin_listing.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <iterator>
#include <nlohmann/json.hpp>
#include <tuple>
#include <utility>

#include "alidade/base/text.h"
#include "alidade/experiment/estimator_registry.h"
#include "alidade/experiment/source_plugin.h"
#include "alidade/io/json.h"
#include "alidade/io/text_table.h"
#include "alidade/plugin/built_in_models.h"
#include "alidade/plugin/create.h"

namespace alidade {
namespace {

using internal::EstimatorType;
using internal::EstimatorTypes;
using internal::FindEstimatorType;
using internal::Join;
using internal::Json;
using internal::TextRow;
using internal::TextTable;

/// Returns the position of a kind in the order of the listing.
std::ptrdiff_t RankOf(const std::string& kind) {
  constexpr std::array kOrder = {kSensorKind, kMotionKind, kSourceKind, kEstimatorKind};
  return std::ranges::find(kOrder, kind) - kOrder.begin();
}

/// Returns the entries of the plugins and those that are part of the program, whose `plugin` is
/// empty, in the order of the listing.
std::vector<PluginEntry> AllEntries(const PluginHost& host) {
  std::vector<PluginEntry> entries = host.entries();
  for (const internal::BuiltInModel& model : internal::kBuiltInModels) {
    for (const char* const kind : {kSensorKind, kMotionKind}) {
      entries.push_back({kind, model.name, model.doc, "", "", ""});
    }
  }
  for (const EstimatorType& type : EstimatorTypes()) {
    entries.push_back({kEstimatorKind, type.name, type.doc, "", "", ""});
  }
  std::ranges::sort(entries, [](const PluginEntry& a, const PluginEntry& b) {
    return std::tuple(RankOf(a.kind), a.kind, a.name, a.plugin) <
           std::tuple(RankOf(b.kind), b.kind, b.name, b.plugin);
  });
  return entries;
}

bool IsBuiltIn(const PluginEntry& entry) { return entry.plugin.empty(); }

/// Appends to `keys` the keys that all types of estimator have.
std::vector<ParamInfo> WithCommonKeys(std::vector<ParamInfo> keys) {
  std::ranges::copy(internal::CommonEstimatorKeys(), std::back_inserter(keys));
  return keys;
}

std::vector<ParamInfo> KeysOf(const PluginEntry& entry) {
  if (entry.kind == kEstimatorKind) {
    return WithCommonKeys(IsBuiltIn(entry) ? FindEstimatorType(entry.name)->schema()
                                           : EstimatorSchema(entry));
  }
  if (entry.kind == kSourceKind) return SourceSchema(entry);
  return entry.is_model() && !IsBuiltIn(entry) ? ModelSchema(entry) : std::vector<ParamInfo>();
}

std::vector<std::string> DescriptionOf(const PluginEntry& entry) {
  return IsBuiltIn(entry) ? std::vector<std::string>() : DescribeModel(entry);
}

/// Returns the entries with the given name. Error: kPlugin if there is no such entry.
std::vector<PluginEntry> EntriesNamed(const PluginHost& host, const std::string& name) {
  std::vector<PluginEntry> entries = AllEntries(host);
  const std::vector<std::string> names = internal::NamesOf(entries);
  std::erase_if(entries, [&](const PluginEntry& entry) { return entry.name != name; });
  if (entries.empty()) {
    const std::string nearest = Nearest(name, names);
    throw Error(ExitCode::kPlugin,
                ErrorLine({}, {}, "no model, source or estimator is named '" + name + "'",
                          "a name from `alidade plugins list`", nearest) +
                    (nearest.empty() ? "\n" + PluginPlaces(host) : ""));
  }
  return entries;
}

std::string Parameters(const std::vector<ParamInfo>& schema) {
  std::vector<TextRow> rows = {
      {"parameter", "unit", "type", "range", "default", "only if", "meaning"}};
  for (const ParamInfo& info : schema) {
    // Keys without a type come from the separate list of keys that a source plugin exports.
    const std::string fallback =
        !info.fallback.empty() || info.type.empty() ? info.fallback : "required";
    const std::string range = info.choices.empty() ? info.range : Join(info.choices, " | ");
    rows.push_back({info.key, info.unit, info.type, range, fallback, info.condition, info.doc});
  }
  return rows.size() > 1 ? TextTable(rows, 2) : "  no parameters\n";
}

Json JsonOf(const PluginEntry& entry) {
  return {{"name", entry.name}, {"kind", entry.kind},         {"family", entry.family},
          {"doc", entry.doc},   {"citation", entry.citation}, {"file", entry.plugin.string()}};
}

Json JsonOf(const std::vector<ParamInfo>& schema) {
  Json parameters = Json::array();
  for (const ParamInfo& info : schema) {
    Json json = {
        {"key", info.key}, {"unit", info.unit}, {"type", info.type}, {"range", info.range}};
    if (!info.fallback.empty()) json["default"] = info.fallback;
    json["choices"] = info.choices;
    json["when"] = info.condition;
    json["doc"] = info.doc;
    parameters.push_back(std::move(json));
  }
  return parameters;
}

}  // namespace

std::string PluginList(const PluginHost& host, bool files) {
  std::vector<TextRow> rows;
  std::string kind;
  for (const PluginEntry& entry : AllEntries(host)) {
    if (entry.kind != kind) rows.push_back({(rows.empty() ? "" : "\n") + entry.kind + 's'});
    kind = entry.kind;
    rows.push_back({"  " + entry.name, entry.doc});
    if (files) rows.back().push_back(IsBuiltIn(entry) ? "built in" : entry.plugin.string());
  }
  return TextTable(rows) + (host.entries().empty() ? "\nno plugins found\n" : "");
}

std::string PluginListJson(const PluginHost& host) {
  Json json = Json::array();
  for (const PluginEntry& entry : AllEntries(host)) json.push_back(JsonOf(entry));
  return internal::JsonText(json);
}

std::vector<ParamInfo> internal::KeysOf(const PluginHost& host, const std::string& kind,
                                        const std::string& name) {
  for (const PluginEntry& entry : AllEntries(host)) {
    if (entry.kind == kind && entry.name == name) return alidade::KeysOf(entry);
  }
  return {};
}

std::string PluginInfo(const PluginHost& host, const std::string& name) {
  std::string text;
  for (const PluginEntry& entry : EntriesNamed(host, name)) {
    if (!text.empty()) text += '\n';
    text += entry.name + ": " + entry.kind + "\n  " + entry.doc + '\n';
    if (!entry.citation.empty()) text += "  source: " + entry.citation + '\n';
    text += "  plugin: " + (IsBuiltIn(entry) ? "built in" : entry.plugin.string()) + '\n';
    const std::vector<std::string> lines = DescriptionOf(entry);
    if (!lines.empty()) text += '\n';
    for (const std::string& line : lines) text += "  " + line + '\n';
    const bool has_keys_in_config = IsBuiltIn(entry) && entry.kind != kEstimatorKind;
    if (!has_keys_in_config) text += '\n' + Parameters(KeysOf(entry));
  }
  return text;
}

std::string PluginInfoJson(const PluginHost& host, const std::string& name) {
  Json json = Json::array();
  for (const PluginEntry& entry : EntriesNamed(host, name)) {
    Json& object = json.emplace_back(JsonOf(entry));
    object["describes"] = DescriptionOf(entry);
    object["parameters"] = JsonOf(KeysOf(entry));
  }
  return internal::JsonText(json);
}

}  // namespace alidade
