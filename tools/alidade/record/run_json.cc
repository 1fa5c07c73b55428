// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/run_json.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "alidade/base/number_text.h"
#include "alidade/experiment/metric_rows.h"
#include "alidade/io/csv_file.h"
#include "alidade/io/json.h"

namespace alidade::internal {
namespace {

/// Returns the entry of one estimator in run.json. `recorded` is null if the run ended before the
/// files were created.
Json JsonOf(const EstimatorResult& result, const RecordedEstimator* recorded) {
  Json json = {{"type", result.type}, {"kind", ToString(result.kind)}};
  if (!result.accepted_by.empty()) json["accepted_by"] = result.accepted_by;
  if (!result.overrides.empty()) json["overrides"] = result.overrides;
  json["sensors"] = result.sensors;
  json["smoothed"] = result.smoothed;
  if (!result.position_block.empty()) json["position_block"] = result.position_block;
  if (recorded != nullptr) {
    Json& blocks = json["blocks"] = Json::array();
    for (const SeriesBlock& block : recorded->blocks) {
      blocks.push_back({{"name", block.name},
                        {"unit", block.unit},
                        {"geometry", block.geometry.name()},
                        {"size", block.geometry.ambient}});
    }
    json["rows"] = recorded->estimate_rows;
  }
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
  for (const Event& event : result.events) ++counts[ToString(event.kind)];
  return counts;
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
  for (const EstimatorResult& estimator : result.estimators) {
    const auto& recorded = facts.recorded.estimators;
    const auto found = std::ranges::find(recorded, estimator.name, &RecordedEstimator::name);
    estimators[estimator.name] = JsonOf(estimator, found == recorded.end() ? nullptr : &*found);
  }
  return JsonText(json);
}

std::string ComparisonCsv(const RunResult& result) {
  std::string text = "metric";
  for (const EstimatorResult& estimator : result.estimators)
    text += ',' + CsvQuoted(estimator.name);
  text += '\n';
  for (const std::string& key : OrderedMetrics(result)) {
    text += CsvQuoted(key);
    for (const EstimatorResult& estimator : result.estimators) {
      text += ',';
      const auto value = estimator.metrics.find(key);
      if (value != estimator.metrics.end()) AppendNumber(text, value->second);
    }
    text += '\n';
  }
  for (const std::string& key : OrderedCounts(result)) {
    text += CsvQuoted(key);
    for (const EstimatorResult& estimator : result.estimators) {
      const auto count = estimator.counts.find(key);
      text += ',' + std::to_string(count == estimator.counts.end() ? 0 : count->second);
    }
    text += '\n';
  }
  text += "diverged";
  for (const EstimatorResult& estimator : result.estimators)
    text += estimator.diverged ? ",true" : ",false";
  text += "\ninconsistent";
  for (const EstimatorResult& estimator : result.estimators) {
    text += estimator.inconsistent ? ",true" : ",false";
  }
  return text + '\n';
}

}  // namespace alidade::internal
