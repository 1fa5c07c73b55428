// SPDX-License-Identifier: Apache-2.0
#include "run_json.h"

#include "comparison_table.h"
#include "csv_file.h"
#include "json.h"
#include "number_text.h"

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

void WriteEstimator(Json& json, const EstimatorResult& result, const RunFacts& facts) {
  json.Key(result.name).Object();
  if (const auto type = facts.types.find(result.name); type != facts.types.end()) {
    json.Key("type").Text(type->second);
  }
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

std::string RunJson(const RunResult& result, const RunFacts& facts) {
  Json json;
  json.Object();
  json.Key("status").Text(ToString(result.status));
  json.Key("reason").Text(result.reason);
  WriteTexts(json.Key("versions"), {{"alidade", ALIDADE_VERSION}});
  json.Key("seed").Integer(static_cast<std::int64_t>(facts.seed));
  json.Key("frames").Integer(result.frames);
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
