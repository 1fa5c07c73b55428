// SPDX-License-Identifier: Apache-2.0
#include "alidade/report/sweep_data.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "alidade/experiment/metric_key.h"
#include "alidade/experiment/metric_table.h"
#include "alidade/report/csv_columns.h"

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

std::vector<std::string> ShownMetrics(const CsvColumns& runs) {
  std::vector<std::string> metrics;
  for (const std::string_view name : runs.names()) {
    if (IsShown(MetricKey::Parse(name))) metrics.emplace_back(name);
  }
  return metrics;
}

std::vector<std::uint32_t> IntegersOf(const std::vector<double>& numbers) {
  std::vector<std::uint32_t> integers;
  for (const double number : numbers) integers.push_back(static_cast<std::uint32_t>(number));
  return integers;
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
Json GroupOf(const SweepRuns& runs, const std::string& estimator, const std::string& value,
             const Json& entry, ColumnPool& pool) {
  const std::vector<std::uint32_t> rows = runs.RowsOf(estimator, value);
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
          {"value", runs.varied_key.empty() ? Json() : Json(value)},
          {"seed", pool.AddIntegers(IntegersOf(Select(runs.table.Numbers("seed"), rows)))},
          {"diverged", pool.AddIntegers(diverged)},
          {"verdicts", entry.value("verdicts", Json::object())},
          {"columns", columns},
          {"bounds", bounds}};
}

}  // namespace

Json SweepData(const std::filesystem::path& folder, const Json& sweep, ColumnPool& pool) {
  const CsvColumns table(folder / "runs.csv");
  if (table.rows() == 0) return {};
  const SweepRuns runs{table, sweep.value("vary", ""), ShownMetrics(table)};
  Json units = Json::object(), groups = Json::array();
  const auto add_groups = [&](const Json& part, const std::string& value) {
    for (const auto& [estimator, entry] : part.at("estimators").items()) {
      const Json block_units = entry.value("units", Json::object());
      for (const std::string& metric : runs.metrics) {
        const std::string unit = UnitOf(MetricKey::Parse(metric), block_units);
        if (!unit.empty()) units[metric] = unit;
      }
      groups.push_back(GroupOf(runs, estimator, value, entry, pool));
    }
  };
  if (runs.varied_key.empty()) add_groups(sweep, "");
  if (!runs.varied_key.empty()) {
    for (const Json& part : sweep.at("values")) add_groups(part, part.at("value"));
  }
  Json shown = Json::array();
  for (const std::string& metric : runs.metrics) {
    const auto has_metric = [&](const Json& group) { return group.at("columns").contains(metric); };
    if (std::ranges::any_of(groups, has_metric)) shown.push_back(metric);
  }
  return {{"first_seed", sweep.value("first_seed", Json())},
          {"runs", sweep.value("runs", Json())},
          {"vary", runs.varied_key.empty() ? Json() : Json(runs.varied_key)},
          {"metrics", shown},
          {"units", units},
          {"groups", groups}};
}

}  // namespace alidade::internal
