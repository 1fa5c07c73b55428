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

Json JsonOf(const Verdict& verdict) {
  return {{"state", ToString(verdict.state)},
          {"because", verdict.because},
          {"since_s", verdict.since == kNoTimestamp ? Json() : Json(Seconds(verdict.since))},
          {"basis", ToString(verdict.basis)}};
}

/// Describes the innovations of a sensor. An element of r without an element of z is null.
Json JsonOf(const InnovationSeries& series) {
  Json z_index = Json::array(), is_angles = Json::array();
  for (const int index : series.z_index) z_index.push_back(index < 0 ? Json() : Json(index));
  for (const char is_angle : series.is_angle) is_angles.push_back(is_angle != 0);
  return {{"units", series.units},
          {"z_index", z_index},
          {"is_angle", is_angles},
          {"robust_loss", series.has_robust_loss},
          {"landmark_prior", series.has_landmark_prior}};
}

}  // namespace

Json EstimatorJson(const EstimatorResult& result, const RecordedEstimator* recorded) {
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
    json["rows"] = recorded->rows;
    Json& innovations = json["innovations"] = Json::object();
    for (const RecordedSensor& sensor : recorded->sensors) {
      innovations[sensor.name] = JsonOf(sensor.series);
    }
  }
  json["failed"] = result.failed;
  Json& metrics = json["metrics"] = result.metrics;
  metrics["diverged"] = result.diverged;
  if (result.expects_poor) json["expect"] = "poor";
  json["verdict"] = JsonOf(result.verdict);
  json["diagnosis"] = FindingsJson(result.findings);
  json["counts"] = result.counts;
  json["units"] = result.units;
  json["events"] = CountEvents(result);
  json["unobservable"] = result.unobservable;
  return json;
}

Json FindingsJson(std::span<const Finding> findings) {
  Json list = Json::array();
  for (const Finding& finding : findings) {
    list.push_back({{"code", ToString(finding.kind)},
                    {"sensor", finding.sensor},
                    {"statistic", finding.statistic},
                    {"text", finding.text}});
  }
  return list;
}

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
  if (const auto verdict = WorstVerdict(result)) json["verdict"] = ToString(*verdict);
  json["reference"] = result.reference;
  if (!result.withheld.empty()) json["withheld"] = result.withheld;
  json["conclusions"] = ConclusionsJson(facts.conclusions);
  Json& plugins = json["plugins"] = Json::array();
  for (const auto& [file, hash] : facts.plugins) {
    plugins.push_back({{"file", file}, {"sha256", hash}});
  }
  Json& estimators = json["estimators"] = Json::object();
  for (const EstimatorResult& estimator : result.estimators) {
    const auto found = std::ranges::find(facts.recorded, estimator.name, &RecordedEstimator::name);
    const bool is_recorded = found != facts.recorded.end();
    // There are no files if the run ended before they were created.
    estimators[estimator.name] = EstimatorJson(estimator, is_recorded ? &*found : nullptr);
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
  text += "verdict";
  for (const EstimatorResult& estimator : result.estimators) {
    text += std::string(",") + ToString(estimator.verdict.state);
  }
  return text + '\n';
}

}  // namespace alidade::internal
