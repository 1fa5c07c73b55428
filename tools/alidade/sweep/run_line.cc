// SPDX-License-Identifier: Apache-2.0
#include "alidade/sweep/run_line.h"

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "alidade/base/number_text.h"
#include "alidade/io/json.h"

namespace alidade::internal {
namespace {

/// JSON has no number that is not finite: such a one is a text. A minus of zero takes a point.
std::string TextOfNumber(double value) {
  if (!std::isfinite(value)) return '"' + NumberText(value) + '"';
  return value == 0.0 && std::signbit(value) ? "-0.0" : NumberText(value);
}

const char* TextOfFlag(bool flag) { return flag ? "true" : "false"; }

/// `"KEY":{...}`, the values as `text` gives them.
template <class Value, class F>
std::string MapText(const char* key, const NamedValues<Value>& map, const F& text) {
  std::string all = JsonString(key) + ":{";
  const char* comma = "";
  for (std::size_t i = 0; i < map.names().size(); ++i) {
    all.append(comma).append(JsonString(map.names()[i])).append(":").append(text(map.values()[i]));
    comma = ",";
  }
  return all + '}';
}

double NumberOf(const Json& json) {
  if (json.is_number()) return json.get<double>();
  const double infinity = std::numeric_limits<double>::infinity();
  const std::string& text = json.get_ref<const std::string&>();
  if (text == "inf") return infinity;
  return text == "-inf" ? -infinity : std::numeric_limits<double>::quiet_NaN();
}

std::string TextOfEstimator(const SweepRow& one) {
  const auto count = [](std::int64_t value) { return std::to_string(value); };
  const auto unit = [](const std::string& value) { return JsonString(value); };
  return "{\"name\":" + JsonString(one.name) + ",\"diverged\":" + TextOfFlag(one.diverged) +
         ",\"inconsistent\":" + TextOfFlag(one.inconsistent) +
         ",\"failed\":" + TextOfFlag(one.failed) + ',' + MapText("units", one.units, unit) + ',' +
         MapText("counts", one.counts, count) + ',' +
         MapText("metrics", one.metrics, TextOfNumber) + '}';
}

SweepRow EstimatorOf(const Json& json) {
  EstimatorResult one;
  one.name = json.at("name").get<std::string>();
  one.diverged = json.at("diverged").get<bool>();
  one.inconsistent = json.at("inconsistent").get<bool>();
  one.failed = json.at("failed").get<bool>();
  one.units = json.at("units").get<std::map<std::string, std::string>>();
  one.counts = json.at("counts").get<std::map<std::string, std::int64_t>>();
  for (const auto& [key, value] : json.at("metrics").items()) one.metrics[key] = NumberOf(value);
  return SweepRow(one);
}

std::string TextOfErrors(const FrameErrors& errors) {
  std::string text = "{\"estimator\":" + JsonString(errors.estimator) +
                     ",\"sensor\":" + JsonString(errors.sensor) +
                     ",\"unit\":" + JsonString(errors.unit) + ",\"rms\":[";
  const char* comma = "";
  for (const double rms : errors.rms) {
    text.append(comma).append(TextOfNumber(rms));
    comma = ",";
  }
  return text + "]}";
}

FrameErrors ErrorsOf(const Json& json) {
  FrameErrors errors{json.at("estimator").get<std::string>(),
                     json.at("sensor").get<std::string>(),
                     json.at("unit").get<std::string>(),
                     {}};
  for (const Json& rms : json.at("rms")) errors.rms.push_back(NumberOf(rms));
  return errors;
}

SweepRun RunOf(const Json& json) {
  SweepRun run;
  run.seed = json.at("seed").get<std::uint64_t>();
  if (json.at("failed").get<bool>()) run.status = RunStatus::kFailed;
  run.code = static_cast<ExitCode>(json.at("code").get<int>());
  run.reason = json.at("reason").get<std::string>();
  run.withheld = json.at("withheld").get<bool>();
  for (const Json& one : json.at("estimators")) run.estimators.push_back(EstimatorOf(one));
  for (const Json& one : json.at("reprojection")) run.reprojection.push_back(ErrorsOf(one));
  return run;
}

}  // namespace

std::string RunLine(const std::string& value, const SweepRun& run) {
  std::string line = "{\"value\":" + JsonString(value) + ",\"seed\":" + std::to_string(run.seed) +
                     ",\"failed\":" + TextOfFlag(run.status == RunStatus::kFailed) +
                     ",\"code\":" + std::to_string(static_cast<int>(run.code)) +
                     ",\"reason\":" + JsonString(run.reason) +
                     ",\"withheld\":" + TextOfFlag(run.withheld) + ",\"estimators\":[";
  for (const SweepRow& one : run.estimators) {
    line += TextOfEstimator(one);
    if (&one != &run.estimators.back()) line += ',';
  }
  line += "],\"reprojection\":[";
  for (const FrameErrors& one : run.reprojection) {
    line += TextOfErrors(one);
    if (&one != &run.reprojection.back()) line += ',';
  }
  return line + "]}\n";
}

std::optional<LineOfRun> ReadRunLine(const std::string& line) {
  try {
    const Json json = Json::parse(line);
    return LineOfRun{json.at("value").get<std::string>(), RunOf(json)};
  } catch (const Json::exception&) {
    return {};
  }
}

}  // namespace alidade::internal
