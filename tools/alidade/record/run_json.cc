// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/run_json.h"

#include "alidade/base/csv_file.h"
#include "alidade/base/json.h"
#include "alidade/base/number_text.h"
#include "alidade/base/words.h"
#include "alidade/run/metric_rows.h"

namespace alidade::internal {
namespace {

void WriteIntegers(Json& json, const std::map<std::string, std::int64_t>& values) {
  json.Object();
  for (const auto& [key, value] : values) json.Key(key).Integer(value);
  json.End();
}

void WriteTexts(Json& json, const std::map<std::string, std::string>& values) {
  json.Object();
  for (const auto& [key, value] : values) json.Key(key).Text(value);
  json.End();
}

void WriteFacts(Json& json, const EstimatorFacts& facts) {
  json.Key("type").Text(facts.type).Key("kind").Text(ToString(facts.kind));
  if (!facts.accepted_by.empty()) json.Key("accepted_by").Text(facts.accepted_by);
  if (!facts.overrides.empty()) json.Key("overrides").Text(facts.overrides);
  json.Key("sensors").Array();
  for (const std::string& sensor : facts.sensors) json.Text(sensor);
  json.End();
  json.Key("smoothed").Flag(facts.smoothed);
  if (!facts.path.empty()) json.Key("path").Text(facts.path);
  json.Key("blocks").Array();
  for (const SeriesBlock& block : facts.blocks) {
    json.Object().Key("name").Text(block.name).Key("unit").Text(block.unit);
    json.Key("geometry").Text(ToString(block.geometry.kind));
    json.Key("size").Integer(block.geometry.ambient).End();
  }
  json.End();
  json.Key("rows").Integer(facts.rows);
}

void WriteEstimator(Json& json, const EstimatorResult& result, const RunFacts& facts) {
  json.Key(result.name).Object();
  if (const auto known = facts.estimators.find(result.name); known != facts.estimators.end()) {
    WriteFacts(json, known->second);
  }
  json.Key("failed").Flag(result.failed);
  json.Key("metrics").Object();
  for (const auto& [key, value] : result.metrics) json.Key(key).Number(value);
  json.Key("diverged").Flag(result.diverged);
  json.Key("inconsistent").Flag(result.inconsistent).End();
  WriteIntegers(json.Key("counts"), result.counts);
  WriteTexts(json.Key("units"), result.units);
  WriteIntegers(json.Key("events"), CountEvents(result));
  json.Key("unobservable").Array();
  for (const std::vector<std::string>& direction : result.unobservable) {
    json.Array();
    for (const std::string& element : direction) json.Text(element);
    json.End();
  }
  json.End();
  json.End();
}

}  // namespace

std::map<std::string, std::int64_t> CountEvents(const EstimatorResult& result) {
  std::map<std::string, std::int64_t> counts;
  for (const Event& event : result.events) ++counts[event.kind];
  return counts;
}

EstimatorFacts FactsOf(const NamedEstimator& named, const Experiment& experiment) {
  const BlockId path = PathBlockOf(named.system);
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

std::string RunJson(const RunResult& result, const RunFacts& facts) {
  Json json;
  json.Object();
  json.Key("status").Text(ToString(result.status));
  json.Key("reason").Text(result.reason);
  WriteTexts(json.Key("versions"), {{"alidade", ALIDADE_VERSION}});
  json.Key("seed").Integer(static_cast<std::int64_t>(facts.seed));
  json.Key("frames").Integer(result.frames);
  if (!facts.measurements_sha256.empty()) {
    json.Key("data").Object().Key("measurements").Text(facts.measurements_sha256);
    if (!facts.truth_sha256.empty()) json.Key("truth").Text(facts.truth_sha256);
    json.End();
  }
  if (!result.normalised.empty()) WriteIntegers(json.Key("normalised"), result.normalised);
  json.Key("reference").Text(result.reference);
  if (!result.withheld.empty()) json.Key("withheld").Text(result.withheld);
  json.Key("plugins").Array();
  for (const auto& [file, hash] : facts.plugins) {
    json.Object().Key("file").Text(file).Key("sha256").Text(hash).End();
  }
  json.End();
  json.Key("estimators").Object();
  for (const EstimatorResult& one : result.estimators) WriteEstimator(json, one, facts);
  json.End().End();
  return json.text();
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
