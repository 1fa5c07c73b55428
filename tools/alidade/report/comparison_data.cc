// SPDX-License-Identifier: Apache-2.0
#include "alidade/report/comparison_data.h"

#include <nlohmann/json.hpp>

#include "alidade/experiment/metric_key.h"
#include "alidade/report/csv_columns.h"

namespace alidade::internal {
namespace {

/// Returns [value, low, high, undecided]. compare.json has a number for one run, and an object for
/// several runs.
Json IntervalOf(const Json& value) {
  if (!value.is_object()) return {value, nullptr, nullptr, false};
  if (value.contains("value")) {
    return {value.at("value"), value.value("low", Json()), value.value("high", Json()),
            value.value("undecided", false)};
  }
  return {value.value("mean", Json()), value.value("p05", Json()), value.value("p95", Json()),
          false};
}

/// Returns the intervals of all values except bounds and degrees of freedom.
Json IntervalsOf(const Json& values) {
  Json intervals = Json::object();
  for (const auto& [key, value] : values.items()) {
    const std::string name = MetricKey::Parse(key).name;
    const bool is_bound = name.ends_with(".low") || name.ends_with(".high");
    if (!is_bound && !name.ends_with(".dof")) intervals[key] = IntervalOf(value);
  }
  return intervals;
}

Json EstimatorOf(const std::string& name, const Json& entry) {
  Json data = {{"name", name}};
  for (const char* key : {"type", "smoothed", "reference", "diverged", "used", "units"}) {
    if (entry.contains(key)) data[key] = entry.at(key);
  }
  data["values"] = IntervalsOf(entry.at("values"));
  return data;
}

Json DecompositionOf(const Json& decomposition) {
  Json steps = Json::array();
  for (const Json& step : decomposition.at("steps")) {
    steps.push_back({{"kind", step.at("kind")},
                     {"from", step.value("from", Json())},
                     {"to", step.value("to", Json())},
                     {"at_end", step.value("at_end", false)},
                     {"values", IntervalsOf(step.at("values"))}});
  }
  return {{"filter", decomposition.value("filter", Json())}, {"steps", steps}};
}

Json OverTime(const CsvColumns& table, ColumnPool& pool) {
  const std::vector<Timestamp> times = table.Times();
  Json columns = Json::object();
  for (const std::string_view name : table.names()) {
    if (name != "t_s") columns[std::string(name)] = pool.AddNumbers(table.Numbers(name));
  }
  return {{"t", pool.AddTimes(times, times.front())}, {"columns", columns}};
}

}  // namespace

Json ComparisonData(const std::filesystem::path& folder, const Json& comparison, ColumnPool& pool) {
  Json data = {{"runs", comparison.at("runs")},
               {"reference", comparison.at("reference")},
               {"notes", comparison.value("notes", Json::array())},
               {"conclusions", comparison.value("conclusions", Json::array())}};
  Json& estimators = data["estimators"] = Json::array();
  for (const auto& [name, entry] : comparison.at("estimators").items()) {
    estimators.push_back(EstimatorOf(name, entry));
  }
  if (comparison.contains("decomposition") && comparison.at("decomposition").is_object()) {
    data["decomposition"] = DecompositionOf(comparison.at("decomposition"));
  }
  const CsvColumns over_time(folder / "over_time.csv");
  if (over_time.rows() > 0) data["over_time"] = OverTime(over_time, pool);
  return data;
}

}  // namespace alidade::internal
