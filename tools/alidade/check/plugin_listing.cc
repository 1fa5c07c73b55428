// SPDX-License-Identifier: Apache-2.0
#include "alidade/check/plugin_listing.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <tuple>
#include <utility>

#include "alidade/base/text.h"
#include "alidade/experiment/estimator_registry.h"
#include "alidade/experiment/source_plugin.h"
#include "alidade/io/json.h"
#include "alidade/io/text_table.h"
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

std::vector<const PluginEntry*> Sorted(const PluginHost& host) {
  std::vector<const PluginEntry*> entries;
  for (const PluginEntry& entry : host.entries()) entries.push_back(&entry);
  std::sort(entries.begin(), entries.end(), [](const PluginEntry* a, const PluginEntry* b) {
    return std::tuple(RankOf(a->kind), a->kind, a->name, a->plugin) <
           std::tuple(RankOf(b->kind), b->kind, b->name, b->plugin);
  });
  return entries;
}

/// Appends to `keys` the keys that all types of estimator have.
std::vector<ParamInfo> WithCommonKeys(std::vector<ParamInfo> keys) {
  const auto add = [&](const char* name, const char* type, const char* fallback, const char* doc,
                       std::vector<std::string> choices = {}) {
    keys.push_back({name, "", doc, type, "", fallback, std::move(choices), ""});
  };
  add("sensors", "list", "all",
      "names of the sensors that the estimator uses, in the order of their updates");
  add("use", "choice or map", "all",
      "all: every measurement; {accepted_by: NAME}: the measurements that the filter NAME accepts");
  add("invariant_error", "map", "none",
      "{side: left, blocks: [...]} or {side: right, blocks: [...]}: the error of position, "
      "orientation and velocity is that of one element of a Euclidean group");
  add("on_divergence", "choice", "report", "report: continue the run; fail: end the run",
      {"report", "fail"});
  add("on_plugin_failure", "choice", "skip",
      "after a failed call of a sensor: skip ignores the measurement, disable ignores the sensor "
      "until the end of the run, abort ends the run",
      {"skip", "disable", "abort"});
  add("overrides", "map", "none",
      "state, sensors, landmarks and initial_time_s for this estimator; merged into the config");
  return keys;
}

std::vector<ParamInfo> KeysOf(const PluginEntry& entry) {
  if (entry.kind == kEstimatorKind) return WithCommonKeys(EstimatorSchema(entry));
  if (entry.kind == kSourceKind) return SourceSchema(entry);
  return entry.is_model() ? ModelSchema(entry) : std::vector<ParamInfo>();
}

/// Finds the entries with the given name. The result is empty only for a built-in estimator.
std::vector<const PluginEntry*> EntriesNamed(const PluginHost& host, const std::string& name) {
  std::vector<const PluginEntry*> entries = Sorted(host);
  std::vector<std::string> names;
  for (const EstimatorType& type : EstimatorTypes()) names.emplace_back(type.name);
  for (const PluginEntry* entry : entries) names.push_back(entry->name);
  std::erase_if(entries, [&](const PluginEntry* entry) { return entry->name != name; });
  if (entries.empty() && FindEstimatorType(name) == nullptr) {
    const std::string nearest = Nearest(name, names);
    throw Error(ExitCode::kPlugin,
                ErrorLine({}, {}, "no plugin entry or built-in estimator is named '" + name + "'",
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
  const std::vector<const PluginEntry*> entries = Sorted(host);
  std::vector<TextRow> rows;
  std::string kind;
  const auto add = [&](const std::string& row_kind, TextRow row) {
    if (row_kind != kind) rows.push_back({(rows.empty() ? "" : "\n") + row_kind + 's'});
    kind = row_kind;
    if (!files) row.pop_back();
    rows.push_back(std::move(row));
  };
  for (const PluginEntry* entry : entries) {
    add(entry->kind, {"  " + entry->name, entry->doc, entry->plugin.string()});
  }
  for (const EstimatorType& type : EstimatorTypes()) {
    add(kEstimatorKind, {std::string("  ") + type.name, type.doc, "built in"});
  }
  return TextTable(rows) + (entries.empty() ? "\nno plugins found\n" : "");
}

std::string PluginListJson(const PluginHost& host) {
  Json json = Json::array();
  for (const PluginEntry* entry : Sorted(host)) json.push_back(JsonOf(*entry));
  for (const EstimatorType& type : EstimatorTypes()) {
    json.push_back(JsonOf({kEstimatorKind, type.name, type.doc, "", "", ""}));
  }
  return internal::JsonText(json);
}

std::vector<ParamInfo> internal::KeysOf(const PluginHost& host, const std::string& kind,
                                        const std::string& name) {
  const EstimatorType* const type = kind == kEstimatorKind ? FindEstimatorType(name) : nullptr;
  if (type != nullptr) return WithCommonKeys(type->schema());
  for (const PluginEntry& entry : host.entries()) {
    if (entry.kind == kind && entry.name == name) return alidade::KeysOf(entry);
  }
  return {};
}

std::string PluginInfo(const PluginHost& host, const std::string& name) {
  std::string text;
  if (const EstimatorType* type = FindEstimatorType(name)) {
    text =
        name + ": estimator\n  " + type->doc + "\n\n" + Parameters(WithCommonKeys(type->schema()));
  }
  for (const PluginEntry* entry : EntriesNamed(host, name)) {
    if (!text.empty()) text += '\n';
    text += entry->name + ": " + entry->kind + "\n  " + entry->doc + '\n';
    if (!entry->citation.empty()) text += "  source: " + entry->citation + '\n';
    text += "  plugin: " + entry->plugin.string() + '\n';
    text += '\n';
    const std::vector<std::string> lines = DescribeModel(*entry);
    for (const std::string& line : lines) text += "  " + line + '\n';
    if (!lines.empty()) text += '\n';
    text += Parameters(KeysOf(*entry));
  }
  return text;
}

std::string PluginInfoJson(const PluginHost& host, const std::string& name) {
  Json json = Json::array();
  if (const EstimatorType* type = FindEstimatorType(name)) {
    json.push_back({{"name", type->name},
                    {"kind", "estimator"},
                    {"doc", type->doc},
                    {"parameters", JsonOf(WithCommonKeys(type->schema()))}});
  }
  for (const PluginEntry* entry : EntriesNamed(host, name)) {
    Json& object = json.emplace_back(JsonOf(*entry));
    object["describes"] = DescribeModel(*entry);
    object["parameters"] = JsonOf(KeysOf(*entry));
  }
  return internal::JsonText(json);
}

}  // namespace alidade
