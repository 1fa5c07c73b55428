// SPDX-License-Identifier: Apache-2.0
#include "alidade/sweep/vary_files.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "alidade/experiment/metric_key.h"
#include "alidade/experiment/metric_rows.h"
#include "alidade/experiment/metric_table.h"
#include "alidade/io/csv_file.h"
#include "alidade/sweep/conclusions.h"
#include "alidade/sweep/table.h"

namespace alidade {
namespace internal {
namespace {

constexpr std::array<std::pair<const char*, double Spread::*>, 4> kSpread = {
    {{"mean", &Spread::mean}, {"p05", &Spread::p05}, {"p50", &Spread::p50}, {"p95", &Spread::p95}}};

/// Summaries of one estimator, one for each value.
using Column = std::vector<SweepSummary>;

/// Returns the summaries of each estimator.
std::vector<Column> ColumnsOf(const VariedSweep& sweep) {
  std::vector<Column> columns(sweep.results.front().estimators.size());
  for (const SweepResult& result : sweep.results) {
    std::vector<SweepSummary> summaries = Summarise(result);
    for (std::size_t i = 0; i < columns.size(); ++i) columns[i].push_back(std::move(summaries[i]));
  }
  return columns;
}

/// Returns the means as the results of a run, with a column for each value. The numbers of a row
/// then have the same unit.
RunResult AsComparison(const Column& column) {
  RunResult comparison;
  for (const SweepSummary& summary : column) {
    EstimatorResult& estimator = comparison.estimators.emplace_back();
    estimator.units = summary.units;
    for (const auto& [key, spread] : summary.metrics) estimator.metrics[key] = spread.mean;
  }
  return comparison;
}

/// Table of one estimator, with a row for each value.
struct ValueTable {
  std::vector<std::string> header;  ///< names of the columns without the label
  std::vector<TableRow> rows;
};

ValueTable TableOf(const VariedSweep& sweep, const Column& column) {
  ValueTable table;
  for (std::size_t v = 0; v < sweep.results.size(); ++v) {
    table.rows.push_back({sweep.variation.values[v], {}});
  }
  const auto add_columns = [&](const std::vector<TableRow>& columns) {
    for (const TableRow& source : columns) {
      table.header.push_back(source.label);
      for (std::size_t v = 0; v < table.rows.size(); ++v) {
        table.rows[v].cells.push_back(source.cells[v]);
      }
    }
  };
  add_columns(VerdictRows(column));
  add_columns(MetricRows(AsComparison(column)));
  return table;
}

/// Returns the distance of a metric from its best value; infinite if no value is the best.
double DistanceFromBest(const MetricInfo& metric, double value) {
  const double infinity = std::numeric_limits<double>::infinity();
  if (metric.goal == MetricGoal::kZero) return std::abs(value);
  if (metric.goal != MetricGoal::kOne) return infinity;
  return value > 0.0 ? std::abs(std::log(value)) : infinity;
}

/// Marks the best value of each metric by ` *`, unless several values are equally good.
void MarkBest(const Column& column, ValueTable& table) {
  const RunResult comparison = AsComparison(column);
  const std::vector<std::string> keys = ShownMetrics(comparison);
  for (std::size_t k = 0; k < keys.size(); ++k) {
    const MetricInfo& metric = *FindMetric(MetricKey::Parse(keys[k]).name);
    std::vector<double> distances;
    for (const EstimatorResult& estimator : comparison.estimators) {
      const auto found = estimator.metrics.find(keys[k]);
      distances.push_back(found == estimator.metrics.end()
                              ? std::numeric_limits<double>::infinity()
                              : DistanceFromBest(metric, found->second));
    }
    const auto best = std::ranges::min_element(distances);
    if (!std::isfinite(*best) || std::ranges::count(distances, *best) > 1) continue;
    const std::size_t first = table.header.size() - keys.size();
    table.rows[static_cast<std::size_t>(best - distances.begin())].cells[first + k] += " *";
  }
}

}  // namespace

void WriteSweepCsv(const OutputFolder& folder, const VariedSweep& sweep) {
  const std::vector<Column> columns = ColumnsOf(sweep);
  std::vector<std::string> header = {sweep.variation.key};
  std::vector<std::vector<std::string>> keys;
  for (const Column& column : columns) {
    const std::string& name = column.front().name;
    header.insert(header.end(), {name + ".used", name + ".diverged", name + ".lost"});
    RunResult comparison = AsComparison(column);
    for (const std::string& key : keys.emplace_back(OrderedMetrics(comparison))) {
      for (const auto& [part, member] : kSpread) header.push_back(name + '.' + part + ':' + key);
    }
  }
  CsvFile csv(folder, "sweep.csv", header);
  for (std::size_t v = 0; v < sweep.results.size(); ++v) {
    csv.Text(sweep.variation.values[v]);
    for (std::size_t i = 0; i < columns.size(); ++i) {
      const SweepSummary& summary = columns[i][v];
      csv.Integer(summary.used)
          .Integer(summary.diverged)
          .Integer(summary.CountOf(VerdictState::kLost));
      for (const std::string& key : keys[i]) {
        const auto found = summary.metrics.find(key);
        for (const auto& [part, member] : kSpread) {
          found == summary.metrics.end() ? csv.Empty() : csv.Number(found->second.*member);
        }
      }
    }
    csv.EndRow();
  }
  csv.Close();
}

std::string VariedMarkdown(const VariedSweep& sweep) {
  const SweepResult& first = sweep.results.front();
  std::string text =
      "Seeds " + std::to_string(first.first_seed) + " to " +
      std::to_string(first.first_seed + static_cast<std::uint64_t>(first.runs) - 1) +
      " for each value" +
      (sweep.variation.scope == Variation::Scope::kEstimators ? ", for the estimators only" : "") +
      ". Means over the runs that did not diverge.\n";
  if (!sweep.warning.empty()) text += "\nWarning: " + sweep.warning + ".\n";
  text += '\n' + FormatConclusions(ConclusionsOf(sweep), TableFormat::kMarkdown);
  for (const Column& column : ColumnsOf(sweep)) {
    const ValueTable table = TableOf(sweep, column);
    const std::string corner = '`' + column.front().name + "`: " + sweep.variation.key;
    text += '\n' + FormatTable(MakeTable(table.header, table.rows, corner), TableFormat::kMarkdown);
  }
  return text + ReferenceLines(sweep);
}

}  // namespace internal

std::string SweepTable(const VariedSweep& sweep, std::size_t width) {
  std::string text =
      internal::FormatConclusions(internal::ConclusionsOf(sweep), internal::TableFormat::kText);
  for (const internal::Column& column : internal::ColumnsOf(sweep)) {
    internal::ValueTable table = internal::TableOf(sweep, column);
    internal::MarkBest(column, table);
    if (column.front().name != sweep.results.front().estimators.front()) text += '\n';
    text += column.front().name + ", means by " + sweep.variation.key + '\n' +
            FormatTable(internal::MakeTable(table.header, table.rows), internal::TableFormat::kText,
                        width);
  }
  return text + internal::ReferenceLines(sweep);
}

}  // namespace alidade
