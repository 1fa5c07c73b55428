// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/run_json.h"

#include <nlohmann/json.hpp>

#include "alidade/base/number_text.h"
#include "alidade/base/words.h"
#include "alidade/experiment/metric_rows.h"
#include "alidade/io/csv_file.h"
#include "alidade/io/json.h"

namespace alidade::internal {
namespace {

Json JsonOf(const EstimatorFacts& facts) {
  Json json = {{"type", facts.type}, {"kind", ToString(facts.kind)}};
  if (!facts.accepted_by.empty()) json["accepted_by"] = facts.accepted_by;
  if (!facts.overrides.empty()) json["overrides"] = facts.overrides;
  json["sensors"] = facts.sensors;
  json["smoothed"] = facts.smoothed;
  if (!facts.position_block.empty()) json["position_block"] = facts.position_block;
  Json& blocks = json["blocks"] = Json::array();
  for (const SeriesBlock& block : facts.blocks) {
    blocks.push_back({{"name", block.name},
                      {"unit", block.unit},
                      {"geometry", ToString(block.geometry.kind)},
                      {"size", block.geometry.ambient}});
  }
  json["rows"] = facts.rows;
  return json;
}

Json JsonOf(const EstimatorResult& result, const RunFacts& facts) {
  const auto known = facts.estimators.find(result.name);
  Json json = known == facts.estimators.end() ? Json::object() : JsonOf(known->second);
  json["failed"] = result.failed;
  Json& metrics = json["metrics"] = result.metrics;
  metrics["diverged"] = result.diverged;
  metrics["inconsistent"] = result.inconsistent;
  json["counts"] = result.counts;
  json["units"] = result.units;
  json["events"] = CountEvents(result);
  json["unobservable"] = result.unobservable;
  return json;
}

}  // namespace

std::map<std::string, std::int64_t> CountEvents(const EstimatorResult& result) {
  std::map<std::string, std::int64_t> counts;
  for (const Event& event : result.events) ++counts[event.kind];
  return counts;
}

EstimatorFacts FactsOf(const NamedEstimator& named, const Experiment& experiment) {
  const BlockId path = PositionBlockOf(named.system);
  const auto by = static_cast<std::size_t>(named.accepted_by);
  return {named.type,
          named.kind,
          named.estimator->offline(),
          named.accepted_by < 0 ? "" : experiment.estimators[by].name,
          named.overrides,
          NamesOf(named.system.sensors),
          path < 0 ? "" : named.system.layout[path].name,
          SeriesBlocksOf(named.system),
          0};
}

std::string UnfinishedRunJson(const std::string& status, const std::string& reason) {
  return JsonText(
      {{"status", status}, {"reason", reason}, {"versions", {{"alidade", ALIDADE_VERSION}}}});
}

std::string RunJson(const RunResult& result, const RunFacts& facts) {
  Json json = {{"status", ToString(result.status)},
               {"reason", result.reason},
               {"versions", {{"alidade", ALIDADE_VERSION}}},
               {"seed", facts.seed},
               {"frames", result.frames}};
  if (!facts.measurements_sha256.empty()) {
    Json& data = json["data"] = {{"measurements", facts.measurements_sha256}};
    if (!facts.truth_sha256.empty()) data["truth"] = facts.truth_sha256;
  }
  if (!result.normalised.empty()) json["normalised"] = result.normalised;
  json["reference"] = result.reference;
  if (!result.withheld.empty()) json["withheld"] = result.withheld;
  Json& plugins = json["plugins"] = Json::array();
  for (const auto& [file, hash] : facts.plugins) {
    plugins.push_back({{"file", file}, {"sha256", hash}});
  }
  Json& estimators = json["estimators"] = Json::object();
  for (const EstimatorResult& one : result.estimators) estimators[one.name] = JsonOf(one, facts);
  return JsonText(json);
}

std::string ComparisonCsv(const RunResult& result) {
  std::string text = "metric";
  for (const EstimatorResult& one : result.estimators) text += ',' + CsvQuoted(one.name);
  text += '\n';
  for (const std::string& key : OrderedMetrics(result)) {
    text += CsvQuoted(key);
    for (const EstimatorResult& one : result.estimators) {
      text += ',';
      const auto value = one.metrics.find(key);
      if (value != one.metrics.end()) AppendNumber(text, value->second);
    }
    text += '\n';
  }
  for (const std::string& key : OrderedCounts(result)) {
    text += CsvQuoted(key);
    for (const EstimatorResult& one : result.estimators) {
      const auto count = one.counts.find(key);
      text += ',' + std::to_string(count == one.counts.end() ? 0 : count->second);
    }
    text += '\n';
  }
  text += "diverged";
  for (const EstimatorResult& one : result.estimators) text += one.diverged ? ",true" : ",false";
  text += "\ninconsistent";
  for (const EstimatorResult& one : result.estimators) {
    text += one.inconsistent ? ",true" : ",false";
  }
  return text + '\n';
}

}  // namespace alidade::internal
