// SPDX-License-Identifier: Apache-2.0
#include "alidade/sweep/run_record.h"

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "alidade/base/number_text.h"
#include "alidade/io/json.h"

namespace alidade::internal {
namespace {

/// Formats a number. A number that is not finite becomes a string, because JSON cannot represent
/// it. Negative zero becomes -0.0, to preserve the sign.
std::string TextOfNumber(double value) {
  if (!std::isfinite(value)) return '"' + NumberText(value) + '"';
  return value == 0.0 && std::signbit(value) ? "-0.0" : NumberText(value);
}

const char* TextOfFlag(bool flag) { return flag ? "true" : "false"; }

/// Returns `"KEY":{...}`. The function `text` formats each value.
template <class Value, class F>
std::string MapText(const char* key, const NamedValues<Value>& map, const F& text) {
  std::string json = JsonString(key) + ":{";
  const char* comma = "";
  for (std::size_t i = 0; i < map.names().size(); ++i) {
    json.append(comma).append(JsonString(map.names()[i])).append(":").append(text(map.values()[i]));
    comma = ",";
  }
  return json + '}';
}

double NumberOf(const Json& json) {
  if (json.is_number()) return json.get<double>();
  const double infinity = std::numeric_limits<double>::infinity();
  const std::string& text = json.get_ref<const std::string&>();
  if (text == "inf") return infinity;
  return text == "-inf" ? -infinity : std::numeric_limits<double>::quiet_NaN();
}

std::string TextOfEstimator(const SweepRow& row) {
  const auto count = [](std::int64_t value) { return std::to_string(value); };
  const auto unit = [](const std::string& value) { return JsonString(value); };
  return "{\"name\":" + JsonString(row.name) + ",\"diverged\":" + TextOfFlag(row.diverged) +
         ",\"verdict\":" + JsonString(ToString(row.verdict)) +
         ",\"failed\":" + TextOfFlag(row.failed) + ',' + MapText("units", row.units, unit) + ',' +
         MapText("counts", row.counts, count) + ',' +
         MapText("metrics", row.metrics, TextOfNumber) + '}';
}

SweepRow EstimatorOf(const Json& json) {
  EstimatorResult result;
  result.name = json.at("name").get<std::string>();
  result.diverged = json.at("diverged").get<bool>();
  result.verdict.state = VerdictStateOf(json.at("verdict").get<std::string>()).value();
  result.failed = json.at("failed").get<bool>();
  result.units = json.at("units").get<std::map<std::string, std::string>>();
  result.counts = json.at("counts").get<std::map<std::string, std::int64_t>>();
  for (const auto& [key, value] : json.at("metrics").items()) result.metrics[key] = NumberOf(value);
  return SweepRow(result);
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
  for (const Json& row : json.at("estimators")) run.estimators.push_back(EstimatorOf(row));
  for (const Json& errors : json.at("reprojection")) run.reprojection.push_back(ErrorsOf(errors));
  return run;
}

}  // namespace

std::string RunLine(const std::string& value, const SweepRun& run) {
  std::string line = "{\"value\":" + JsonString(value) + ",\"seed\":" + std::to_string(run.seed) +
                     ",\"failed\":" + TextOfFlag(run.status == RunStatus::kFailed) +
                     ",\"code\":" + std::to_string(static_cast<int>(run.code)) +
                     ",\"reason\":" + JsonString(run.reason) +
                     ",\"withheld\":" + TextOfFlag(run.withheld) + ",\"estimators\":[";
  for (const SweepRow& row : run.estimators) {
    line += TextOfEstimator(row);
    if (&row != &run.estimators.back()) line += ',';
  }
  line += "],\"reprojection\":[";
  for (const FrameErrors& errors : run.reprojection) {
    line += TextOfErrors(errors);
    if (&errors != &run.reprojection.back()) line += ',';
  }
  return line + "]}\n";
}

std::optional<ParsedRunLine> ReadRunLine(const std::string& line) {
  try {
    const Json json = Json::parse(line);
    return ParsedRunLine{json.at("value").get<std::string>(), RunOf(json)};
  } catch (const Json::exception&) {
    return {};
  }
}

}  // namespace alidade::internal
