// SPDX-License-Identifier: Apache-2.0
#include "alidade/report/sweep_data.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "alidade/base/text.h"
#include "alidade/experiment/metric_key.h"
#include "alidade/experiment/metric_table.h"
#include "alidade/report/csv_columns.h"
#include "alidade/report/value_labels.h"

namespace alidade::internal {
namespace {

/// Returns true for the metrics of a page: those without bounds, degrees of freedom and counts. Of
/// the metrics of segments, only the RMSE is shown.
bool IsShown(const MetricKey& key) {
  const bool is_bound = key.name.ends_with(".low") || key.name.ends_with(".high");
  if (FindMetric(key.name) == nullptr || is_bound || key.name.ends_with(".dof")) return false;
  return key.segment.empty() || key.name == "rmse";
}

/// Returns the unit of a metric. `units` contains the units of the blocks.
std::string UnitOf(const MetricKey& key, const Json& units) {
  switch (FindMetric(key.name)->unit) {
    case MetricUnit::kSubject:
      return units.value(key.subject, "");
    case MetricUnit::kMetre:
      return "m";
    case MetricUnit::kMillisecond:
      return "ms";
    case MetricUnit::kMicrosecond:
      return "us";
    case MetricUnit::kFrames:
    case MetricUnit::kShare:
    case MetricUnit::kNone:
      break;
  }
  return "";
}

/// Returns `zero`, `one` or `0.95`, or null if no value of the metric is the best.
Json GoalOf(const MetricKey& key) {
  switch (FindMetric(key.name)->goal) {
    case MetricGoal::kZero:
      return "zero";
    case MetricGoal::kOne:
      return "one";
    case MetricGoal::k95Percent:
      return "0.95";
    case MetricGoal::kNone:
      break;
  }
  return {};
}

/// Describes the metrics: their units and goals, and those that the figures of a varied sweep show.
void DescribeMetrics(const Json& units, Json& data) {
  std::vector<std::string> keys;
  Json& goals = data["goals"] = Json::object();
  Json& varied = data["varied_metrics"] = Json::array();
  for (const Json& metric : data.at("metrics")) {
    const MetricKey key = MetricKey::Parse(keys.emplace_back(metric));
    goals[keys.back()] = GoalOf(key);
    if (FindMetric(key.name)->is_shown && key.segment.empty()) varied.push_back(metric);
  }
  data["units"] = units;
  data["main_metric"] = MainErrorKey(keys);
}

std::vector<std::string> ShownMetrics(const CsvColumns& runs) {
  std::vector<std::string> metrics;
  for (const std::string_view name : runs.names()) {
    if (IsShown(MetricKey::Parse(name))) metrics.emplace_back(name);
  }
  return metrics;
}

/// Value of the varied key. The value is "" if the sweep varies only the seed.
struct VariedValue {
  std::string value, label;
};

/// Returns the options of `alidade run` that set the varied keys for an estimator.
std::string OptionsOf(const Json& sweep, const std::string& value, const std::string& estimator) {
  const std::string keys = sweep.value("vary", "");
  const bool is_override = sweep.value("scope", "") == "estimators";
  const std::string prefix = is_override ? "estimators." + estimator + ".overrides." : "";
  if (keys.empty()) return "";
  std::string options;
  for (std::size_t begin = 0; begin <= keys.size();) {
    const std::size_t end = std::min(keys.find('+', begin), keys.size());
    options += " --set " + ShellWord(prefix + keys.substr(begin, end - begin) + '=' + value);
    begin = end + 1;
  }
  return options;
}

/// Returns all values of the varied key.
std::vector<VariedValue> ValuesOf(const Json& sweep) {
  if (!sweep.contains("values")) return {{"", ""}};
  std::vector<std::string> values;
  for (const Json& part : sweep.at("values")) values.push_back(part.at("value"));
  const std::vector<std::string> labels = ValueLabels(values);
  std::vector<VariedValue> varied;
  for (std::size_t i = 0; i < values.size(); ++i) {
    varied.push_back({values[i], labels[i]});
  }
  return varied;
}

/// Runs of a sweep: runs.csv, the varied key and the metrics.
struct SweepRuns {
  const CsvColumns& table;
  std::string varied_key;  ///< "": the sweep varies only the seed
  std::vector<std::string> metrics;

  /// Returns the rows of an estimator with the value `value` of the varied key.
  std::vector<std::uint32_t> RowsOf(const std::string& estimator, const std::string& value) const {
    const auto estimators = table.Texts("estimator"), values = table.Texts(varied_key);
    std::vector<std::uint32_t> rows;
    for (std::uint32_t row = 0; row < estimators.size(); ++row) {
      const bool has_value = varied_key.empty() || values[row] == value;
      if (estimators[row] == estimator && has_value) rows.push_back(row);
    }
    return rows;
  }
};

/// Returns the runs of an estimator with one value of the varied key. `entry` is its summary in
/// sweep.json.
Json GroupOf(const SweepRuns& runs, const std::string& estimator, const VariedValue& value,
             const std::string& command, const Json& entry, ColumnPool& pool) {
  const std::vector<std::uint32_t> rows = runs.RowsOf(estimator, value.value);
  std::vector<std::uint32_t> diverged;
  for (const std::string_view verdict : Select(runs.table.Texts("verdict"), rows)) {
    diverged.push_back(verdict == "diverged" || verdict == "failed" ? 1 : 0);
  }
  Json columns = Json::object(), bounds = Json::object();
  for (const std::string& metric : runs.metrics) {
    const std::vector<double> numbers = Select(runs.table.Numbers(metric), rows);
    const bool is_known =
        std::ranges::any_of(numbers, [](double number) { return !std::isnan(number); });
    if (is_known) columns[metric] = pool.AddNumbers(numbers);
  }
  const Json all_bounds = entry.value("bounds", Json::object());
  for (const auto& [key, interval] : all_bounds.items()) {
    bounds[key] = {interval.at("low"), interval.at("high")};
  }
  return {{"estimator", estimator},
          {"value", runs.varied_key.empty() ? Json() : Json(value.value)},
          {"label", value.label},
          {"command", command},
          {"seeds", Select(runs.table.Texts("seed"), rows)},
          {"diverged", pool.AddIntegers(diverged)},
          {"verdicts", entry.value("verdicts", Json::object())},
          {"columns", columns},
          {"bounds", bounds}};
}

/// Returns the mean reprojection errors over the frames, for each estimator and sensor and each
/// value of the varied key.
Json ReprojectionData(const CsvColumns& table, const std::string& varied_key, ColumnPool& pool) {
  const auto estimators = table.Texts("estimator"), sensors = table.Texts("sensor"),
             units = table.Texts("unit"), values = table.Texts(varied_key);
  const std::vector<double> frames = table.Numbers("frame"), rms = table.Numbers("rms");
  // Rows of one figure, by value of the varied key.
  std::map<std::pair<std::string_view, std::string_view>,
           std::map<std::string_view, std::vector<std::uint32_t>>>
      figures;
  for (std::uint32_t row = 0; row < estimators.size(); ++row) {
    figures[{estimators[row], sensors[row]}][values[row]].push_back(row);
  }
  Json list = Json::array();
  for (const auto& [key, rows_of_value] : figures) {
    Json series = Json::array();
    for (const auto& [value, rows] : rows_of_value) {
      series.push_back({{"value", std::string(value)},
                        {"frame", pool.AddNumbers(Select(frames, rows))},
                        {"rms", pool.AddNumbers(Select(rms, rows))}});
    }
    list.push_back({{"estimator", std::string(key.first)},
                    {"sensor", std::string(key.second)},
                    {"unit", std::string(units[rows_of_value.begin()->second.front()])},
                    {"series", series}});
  }
  return list;
}

}  // namespace

Json SweepData(const std::filesystem::path& folder, const Json& sweep,
               const std::string& run_command, ColumnPool& pool) {
  const CsvColumns table(folder / "runs.csv");
  if (table.rows() == 0) return {};
  const SweepRuns runs{table, sweep.value("vary", ""), ShownMetrics(table)};
  Json units = Json::object(), groups = Json::array(), shown = Json::array();
  const std::vector<VariedValue> values = ValuesOf(sweep);
  for (std::size_t v = 0; v < values.size(); ++v) {
    const Json& part = runs.varied_key.empty() ? sweep : sweep.at("values").at(v);
    for (const auto& [estimator, entry] : part.at("estimators").items()) {
      const Json block_units = entry.value("units", Json::object());
      for (const std::string& metric : runs.metrics) {
        const std::string unit = UnitOf(MetricKey::Parse(metric), block_units);
        if (!unit.empty()) units[metric] = unit;
      }
      const std::string command = run_command + OptionsOf(sweep, values[v].value, estimator);
      groups.push_back(GroupOf(runs, estimator, values[v], command, entry, pool));
    }
  }
  for (const std::string& metric : runs.metrics) {
    const auto has_metric = [&](const Json& group) { return group.at("columns").contains(metric); };
    if (std::ranges::any_of(groups, has_metric)) shown.push_back(metric);
  }
  Json data = {{"first_seed", sweep.value("first_seed", Json())},
               {"runs", sweep.value("runs", Json())},
               {"vary", runs.varied_key.empty() ? Json() : Json(runs.varied_key)},
               {"warning", sweep.value("warning", "")},
               {"conclusions", sweep.value("conclusions", Json::array())},
               {"metrics", shown}};
  DescribeMetrics(units, data);
  data["groups"] = groups;
  data["reprojection"] =
      ReprojectionData(CsvColumns(folder / "reprojection.csv"), runs.varied_key, pool);
  return data;
}

}  // namespace alidade::internal
